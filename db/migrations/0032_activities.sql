-- Schema 32: what the cell is doing, so that a start finds what the program's end broke off that was no run.

-- The newest row counts. One is written before anything moves, and another when the cell rests again: a start that
-- finds the first is Aborted.
CREATE TABLE activities (
  id        INTEGER PRIMARY KEY AUTOINCREMENT,
  under_way INTEGER NOT NULL CHECK (under_way IN (0, 1)),
  doing     TEXT    NOT NULL,  -- goes on behind "the program ended", as in "while the laser was homed"; '' at rest
  at        TEXT    NOT NULL,
  checksum  INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('activities', id, under_way, doing, at)) STORED
) STRICT;

CREATE TRIGGER only_what_began_ends BEFORE INSERT ON activities
WHEN NEW.under_way = 0 AND coalesce((SELECT under_way FROM activities ORDER BY id DESC LIMIT 1), 0) = 0
BEGIN
  SELECT RAISE(ABORT, 'nothing is under way that could end');
END;
CREATE TRIGGER activities_are_never_edited BEFORE UPDATE ON activities
BEGIN
  SELECT RAISE(ABORT, 'what the cell did is never edited');
END;
CREATE TRIGGER activities_are_kept BEFORE DELETE ON activities
BEGIN
  SELECT RAISE(ABORT, 'what the cell did is never removed');
END;
