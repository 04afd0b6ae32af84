-- Schema 29: which pieces are laid at their place in the picture. A person ticks them off, and takes a tick back.

-- Of the piece's wood: a piece that is made again is another one in the hand. Wood is what its newest row says, and as
-- long as it is cut; wood without a row is not assembled.
CREATE TABLE assemblies (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  allocation INTEGER NOT NULL REFERENCES allocations (id),
  assembled  INTEGER NOT NULL CHECK (assembled IN (0, 1)),
  who        TEXT    NOT NULL,
  at         TEXT    NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('assemblies', id, allocation, assembled, who, at)) STORED
) STRICT;
CREATE INDEX assemblies_of ON assemblies (allocation);

CREATE TRIGGER assembled_wood_is_a_cut_piece BEFORE INSERT ON assemblies
WHEN NEW.assembled = 1
 AND NOT EXISTS (SELECT 1 FROM allocations WHERE id = NEW.allocation AND piece IS NOT NULL AND state = 'cut')
BEGIN
  SELECT RAISE(ABORT, 'only a piece that is cut is assembled');
END;
CREATE TRIGGER assemblies_are_never_edited BEFORE UPDATE ON assemblies
BEGIN
  SELECT RAISE(ABORT, 'that a piece was assembled is never edited');
END;
CREATE TRIGGER assemblies_are_kept BEFORE DELETE ON assemblies
BEGIN
  SELECT RAISE(ABORT, 'that a piece was assembled is never removed');
END;
