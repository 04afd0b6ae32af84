-- Schema 7: which laser was at the port, as its controller tells, so that what was measured on one is void on another.

-- A row whenever another one than before was found. Certificates up to `after_certificate` were made before that.
CREATE TABLE lasers (
  id                INTEGER PRIMARY KEY AUTOINCREMENT,
  identity          TEXT    NOT NULL CHECK (identity <> ''),
  after_certificate INTEGER NOT NULL CHECK (after_certificate >= 0),
  found_at          TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('lasers', id, identity, after_certificate, found_at))
    STORED
) STRICT;

CREATE TRIGGER lasers_are_never_edited BEFORE UPDATE ON lasers
BEGIN
  SELECT RAISE(ABORT, 'which laser was there is never edited');
END;
CREATE TRIGGER lasers_are_kept BEFORE DELETE ON lasers
BEGIN
  SELECT RAISE(ABORT, 'which laser was there is never removed');
END;
