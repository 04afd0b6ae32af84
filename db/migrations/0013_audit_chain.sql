-- Schema 13: the audit log becomes a chain: each row carries a hash of the row before it and of its own columns. Rows
-- that are there are chained as they are.
CREATE TEMP TABLE old_audit (place INTEGER PRIMARY KEY, id INTEGER, at TEXT, who TEXT, what TEXT, detail TEXT);
INSERT INTO temp.old_audit
SELECT row_number() OVER (ORDER BY id), id, at, who, what, detail FROM main.audit;
DROP TABLE main.audit;

CREATE TABLE audit (
  id     INTEGER PRIMARY KEY AUTOINCREMENT,
  at     TEXT NOT NULL,
  who    TEXT NOT NULL,
  what   TEXT NOT NULL,
  detail TEXT NOT NULL,
  hash   TEXT NOT NULL CHECK (length(hash) = 64),
  checksum INTEGER NOT NULL
           GENERATED ALWAYS AS (veneer_checksum('audit', id, at, who, what, detail, hash)) STORED
) STRICT;
INSERT INTO audit (id, at, who, what, detail, hash)
WITH RECURSIVE chained (place, id, at, who, what, detail, hash) AS (
  SELECT place, id, at, who, what, detail, veneer_audit_hash('', id, at, who, what, detail)
  FROM temp.old_audit WHERE place = 1
  UNION ALL
  SELECT o.place, o.id, o.at, o.who, o.what, o.detail,
         veneer_audit_hash(c.hash, o.id, o.at, o.who, o.what, o.detail)
  FROM chained AS c JOIN temp.old_audit AS o ON o.place = c.place + 1)
SELECT id, at, who, what, detail, hash FROM chained ORDER BY place;
DROP TABLE temp.old_audit;

CREATE TRIGGER audit_rows_follow BEFORE INSERT ON audit
WHEN NEW.hash IS NOT veneer_audit_hash(coalesce((SELECT hash FROM audit ORDER BY id DESC LIMIT 1), ''),
                                       NEW.id, NEW.at, NEW.who, NEW.what, NEW.detail)
BEGIN
  SELECT RAISE(ABORT, 'the row does not follow from the last row of the audit log');
END;
CREATE TRIGGER audit_is_never_edited BEFORE UPDATE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
CREATE TRIGGER audit_is_never_shortened BEFORE DELETE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
