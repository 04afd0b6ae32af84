-- Schema 21: what a scan saw of a suspect piece's wood. A proposal, until a person says what became of the piece.

CREATE TABLE sightings (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  allocation   INTEGER NOT NULL REFERENCES allocations (id),
  step         INTEGER NOT NULL REFERENCES allocation_history (id),  -- by which it was suspect
  seen         TEXT    NOT NULL CHECK (seen IN ('cut', 'still_there', 'unclear')),
  gone         REAL    NOT NULL CHECK (gone BETWEEN 0 AND 1),  -- share of the piece's inside
  mask_version INTEGER NOT NULL CHECK (mask_version > 0),      -- that the scan entered
  at           TEXT    NOT NULL,
  checksum     INTEGER NOT NULL
               GENERATED ALWAYS AS (veneer_checksum('sightings', id, allocation, step, seen, gone, mask_version,
                                                    at)) STORED
) STRICT;
CREATE INDEX sightings_of ON sightings (allocation);

CREATE TRIGGER sightings_are_of_suspect_wood BEFORE INSERT ON sightings
WHEN NOT EXISTS (SELECT 1 FROM allocations AS a JOIN allocation_history AS h ON h.allocation = a.id
                 WHERE a.id = NEW.allocation AND a.state = 'suspect' AND h.id = NEW.step AND h.state = 'suspect')
BEGIN
  SELECT RAISE(ABORT, 'only of suspect wood it is noted what a scan saw');
END;
CREATE TRIGGER sightings_are_never_edited BEFORE UPDATE ON sightings
BEGIN
  SELECT RAISE(ABORT, 'what a scan saw is never edited');
END;
CREATE TRIGGER sightings_are_kept BEFORE DELETE ON sightings
BEGIN
  SELECT RAISE(ABORT, 'what a scan saw is never removed');
END;
