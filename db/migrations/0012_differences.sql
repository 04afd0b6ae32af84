-- Schema 12: what a scan and the ledger disagreed about, until a person decides.

CREATE TABLE differences (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  panel    TEXT    NOT NULL REFERENCES panels (id),
  kind     TEXT    NOT NULL CHECK (kind IN ('gone_not_booked', 'booked_not_gone')),
  place_um TEXT    NOT NULL,  -- a list of one point
  shape_um TEXT    NOT NULL CHECK (shape_um <> ''),  -- an area: what was seen of it
  area_um2 INTEGER NOT NULL CHECK (area_um2 >= 0),
  pieces   TEXT    NOT NULL CHECK (json_type(pieces) = 'array'),
  found_at TEXT    NOT NULL,
  checksum INTEGER NOT NULL
           GENERATED ALWAYS AS (veneer_checksum('differences', id, panel, kind, place_um, shape_um, area_um2, pieces,
                                                found_at)) STORED
) STRICT;
CREATE INDEX differences_of_panel ON differences (panel);

-- One without a verdict is open; of several the newest counts.
CREATE TABLE difference_verdicts (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  difference INTEGER NOT NULL REFERENCES differences (id),
  verdict    TEXT NOT NULL CHECK (verdict IN ('written_off', 'accepted', 'not_seen_again', 'grown')),
  who        TEXT NOT NULL,
  note       TEXT NOT NULL,
  at         TEXT NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('difference_verdicts', id, difference, verdict, who, note, at)) STORED
) STRICT;
CREATE INDEX difference_verdicts_of ON difference_verdicts (difference);

CREATE TRIGGER differences_are_never_edited BEFORE UPDATE ON differences
BEGIN
  SELECT RAISE(ABORT, 'what a scan found is never edited');
END;
CREATE TRIGGER differences_are_kept BEFORE DELETE ON differences
BEGIN
  SELECT RAISE(ABORT, 'what a scan found is never removed');
END;
-- What was accepted holds for as long as scans see it so.
CREATE TRIGGER differences_are_decided_once BEFORE INSERT ON difference_verdicts
WHEN EXISTS (SELECT 1 FROM difference_verdicts
             WHERE difference = NEW.difference
               AND (verdict <> 'accepted' OR NEW.verdict NOT IN ('not_seen_again', 'grown')))
BEGIN
  SELECT RAISE(ABORT, 'a difference is decided once');
END;
CREATE TRIGGER difference_verdicts_are_never_edited BEFORE UPDATE ON difference_verdicts
BEGIN
  SELECT RAISE(ABORT, 'what was decided is never edited');
END;
CREATE TRIGGER difference_verdicts_are_kept BEFORE DELETE ON difference_verdicts
BEGIN
  SELECT RAISE(ABORT, 'what was decided is never removed');
END;
