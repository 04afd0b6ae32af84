-- Schema 5: versions of a panel's map and mask; requests that must not be done twice.

-- What a panel's wood looked like, and which of it is usable. The highest version counts; a plan names the version it
-- was made on.
CREATE TABLE masks (
  panel     TEXT    NOT NULL REFERENCES panels (id),
  version   INTEGER NOT NULL CHECK (version > 0),
  map_file  TEXT    NOT NULL,
  mask_file TEXT    NOT NULL,
  map_hash  TEXT    NOT NULL,
  made_at   TEXT    NOT NULL,
  PRIMARY KEY (panel, version)
) STRICT, WITHOUT ROWID;
INSERT INTO masks SELECT id, 1, map_file, mask_file, map_hash, created_at FROM panels;
ALTER TABLE panels DROP COLUMN map_file;
ALTER TABLE panels DROP COLUMN mask_file;
ALTER TABLE panels DROP COLUMN map_hash;

CREATE TRIGGER masks_are_never_edited BEFORE UPDATE ON masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never edited');
END;
CREATE TRIGGER masks_are_kept BEFORE DELETE ON masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never edited');
END;

-- Requests made under a key of the caller's (Idempotency-Key), so that a repeated one is answered, not done again.
CREATE TABLE request_keys (
  who          TEXT NOT NULL,
  operation    TEXT NOT NULL,
  key          TEXT NOT NULL CHECK (key <> ''),
  request_hash TEXT NOT NULL,
  reply        TEXT,  -- what was answered at once
  result       TEXT,  -- what came of it, written together with it
  at           TEXT NOT NULL,
  PRIMARY KEY (who, operation, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX request_keys_by_age ON request_keys (at);
