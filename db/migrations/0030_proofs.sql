-- Schema 30: up to which booking of a run its panel was seen where it has to lie. It was read from the audit log before.

-- A run that looks again has its first row from its beginning. What it booked after the newest one is owed a look.
CREATE TABLE proofs (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  run      INTEGER NOT NULL REFERENCES runs (id),
  step     INTEGER REFERENCES allocation_history (id),  -- NULL: it had booked nothing yet
  at       TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('proofs', id, run, step, at)) STORED
) STRICT;
CREATE INDEX proofs_of_run ON proofs (run);

CREATE TRIGGER proofs_are_never_edited BEFORE UPDATE ON proofs
BEGIN
  SELECT RAISE(ABORT, 'a proof of the pose is never edited');
END;
CREATE TRIGGER proofs_are_kept BEFORE DELETE ON proofs
BEGIN
  SELECT RAISE(ABORT, 'a proof of the pose is never removed');
END;

-- "run 7 of job 3 on P-0001, 25 pieces cut before": the run, and the step by which it booked the 25th of them. A run
-- without such a row was never to look again, or is of a version that did not.
WITH bookings (run, id, number) AS MATERIALIZED (
  SELECT h.run, h.id, row_number() OVER (PARTITION BY h.run ORDER BY h.id)
  FROM allocation_history AS h
  WHERE h.run IS NOT NULL AND h.state = 'cut'
    AND (SELECT p.state FROM allocation_history AS p
         WHERE p.allocation = h.allocation AND p.id < h.id ORDER BY p.id DESC LIMIT 1) = 'cutting'
),
told (id, run, number, at) AS (
  SELECT s.id, CAST(substr(s.detail, 5) AS INTEGER),
         CAST(substr(s.said, length(rtrim(s.said, '0123456789')) + 1) AS INTEGER), s.at
  FROM (SELECT id, at, detail, substr(detail, 1, length(detail) - length(' pieces cut before')) AS said
        FROM audit WHERE what = 'run.proven' AND detail LIKE 'run % of job % on %, % pieces cut before') AS s
)
INSERT INTO proofs (run, step, at)
SELECT told.run, bookings.id, told.at
FROM told JOIN runs ON runs.id = told.run
LEFT JOIN bookings ON bookings.run = told.run AND bookings.number = told.number
ORDER BY told.id;
