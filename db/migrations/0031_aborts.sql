-- Schema 31: what broke the cell's work off and whether it was cleared, which wood of jobs was lost, and that a person may
-- take back that a piece is lost.

-- The newest row counts. While it is of an abort, each start of the program finds the cell Aborted: Clear is owed.
CREATE TABLE aborts (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  cleared  INTEGER NOT NULL CHECK (cleared IN (0, 1)),
  who      TEXT    NOT NULL,  -- cleared it; of an abort the program, which notes it
  reason   TEXT    NOT NULL,  -- why the work was broken off; '' of a Clear
  at       TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('aborts', id, cleared, who, reason, at)) STORED
) STRICT;

CREATE TRIGGER only_an_abort_is_cleared BEFORE INSERT ON aborts
WHEN NEW.cleared = 1 AND coalesce((SELECT cleared FROM aborts ORDER BY id DESC LIMIT 1), 1) = 1
BEGIN
  SELECT RAISE(ABORT, 'there is no abort that could be cleared');
END;
CREATE TRIGGER aborts_are_never_edited BEFORE UPDATE ON aborts
BEGIN
  SELECT RAISE(ABORT, 'that work was broken off is never edited');
END;
CREATE TRIGGER aborts_are_kept BEFORE DELETE ON aborts
BEGIN
  SELECT RAISE(ABORT, 'that work was broken off is never removed');
END;

-- Which jobs have lost pieces is asked as often as which have some to cut (schema 27).
CREATE INDEX allocations_lost ON allocations (job) WHERE state IN ('scrap', 'released');

-- Its wood was free to nobody meanwhile, and a piece that has other wood since is not the newest any more.
DROP TRIGGER allocation_moves_are_complete;
INSERT INTO allocation_moves (from_state, to_state) VALUES ('scrap', 'suspect');
CREATE TRIGGER allocation_moves_are_complete BEFORE INSERT ON allocation_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of wood are fixed');
END;
CREATE TRIGGER only_a_piece_is_found_again BEFORE UPDATE OF state ON allocations
WHEN OLD.state = 'scrap' AND NEW.state = 'suspect'
 AND (OLD.piece IS NULL OR OLD.id <> (SELECT max(id) FROM allocations WHERE job = OLD.job AND piece = OLD.piece)
  OR (SELECT retired FROM retirements WHERE panel = OLD.panel ORDER BY id DESC LIMIT 1) = 1)
BEGIN
  SELECT RAISE(ABORT, 'only a lost piece that has no other wood, of a panel in stock, is suspect again');
END;
