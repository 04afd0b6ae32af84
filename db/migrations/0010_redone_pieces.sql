-- Schema 10: pieces that are lost are made again, of other wood, and keep their numbers.

-- A plan that places patches of a job's plan anew, and was reserved for that job.
CREATE TABLE redos (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  job      INTEGER NOT NULL REFERENCES jobs (id),
  plan     INTEGER NOT NULL REFERENCES plans (id),
  at       TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('redos', id, job, plan, at)) STORED,
  UNIQUE (plan)
) STRICT;
CREATE INDEX redos_of_job ON redos (job);

CREATE TRIGGER redos_are_never_edited BEFORE UPDATE ON redos
BEGIN
  SELECT RAISE(ABORT, 'that pieces were made again is never edited');
END;
CREATE TRIGGER redos_are_kept BEFORE DELETE ON redos
BEGIN
  SELECT RAISE(ABORT, 'that pieces were made again is never removed');
END;

-- A job that is over has pieces to cut again.
DROP TRIGGER job_moves_are_complete;
INSERT INTO job_moves (from_state, to_state) VALUES ('complete', 'stopped'), ('cancelled', 'stopped');
CREATE TRIGGER job_moves_are_complete BEFORE INSERT ON job_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of a job are fixed');
END;
