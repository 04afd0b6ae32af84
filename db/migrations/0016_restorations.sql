-- Schema 16: that a backup took the place of the database. What was cut between the two is in none of its rows; a scan
-- with a greater number than last_scan was made since, whatever the clock said.

CREATE TABLE restorations (
  id        INTEGER PRIMARY KEY AUTOINCREMENT,
  made_at   TEXT    NOT NULL,  -- the backup
  last_scan INTEGER NOT NULL CHECK (last_scan >= 0),  -- in the backup; 0: none
  who       TEXT    NOT NULL,
  at        TEXT    NOT NULL,
  checksum  INTEGER NOT NULL
            GENERATED ALWAYS AS (veneer_checksum('restorations', id, made_at, last_scan, who, at)) STORED
) STRICT;

CREATE TRIGGER restorations_are_never_edited BEFORE UPDATE ON restorations
BEGIN
  SELECT RAISE(ABORT, 'that a backup was put back is never edited');
END;
CREATE TRIGGER restorations_are_kept BEFORE DELETE ON restorations
BEGIN
  SELECT RAISE(ABORT, 'that a backup was put back is never removed');
END;
