-- Schema 18: jobs that are over and out of sight. Nothing of them is removed.

-- A job is what its newest row says; one without a row is in sight.
CREATE TABLE archivings (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  job      INTEGER NOT NULL REFERENCES jobs (id),
  archived INTEGER NOT NULL CHECK (archived IN (0, 1)),
  at       TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('archivings', id, job, archived, at)) STORED
) STRICT;
CREATE INDEX archivings_of_job ON archivings (job);

CREATE TRIGGER archivings_are_never_edited BEFORE UPDATE ON archivings
BEGIN
  SELECT RAISE(ABORT, 'that a job was archived is never edited');
END;
CREATE TRIGGER archivings_are_kept BEFORE DELETE ON archivings
BEGIN
  SELECT RAISE(ABORT, 'that a job was archived is never removed');
END;
CREATE TRIGGER archived_jobs_are_over BEFORE INSERT ON archivings
WHEN NEW.archived = 1
 AND ((SELECT state FROM jobs WHERE id = NEW.job) NOT IN ('complete', 'cancelled')
  OR EXISTS (SELECT 1 FROM allocations WHERE job = NEW.job AND state IN ('reserved', 'cutting', 'suspect')))
BEGIN
  SELECT RAISE(ABORT, 'a job that is not over stays in sight');
END;
-- Pieces of it are to be made again, or may have been hit by another job's beam.
CREATE TRIGGER jobs_that_go_on_are_in_sight AFTER UPDATE OF state ON jobs
WHEN NEW.state NOT IN ('complete', 'cancelled')
 AND (SELECT archived FROM archivings WHERE job = NEW.id ORDER BY id DESC LIMIT 1) = 1
BEGIN
  INSERT INTO archivings (job, archived, at) VALUES (NEW.id, 0, NEW.changed_at);
END;
CREATE TRIGGER jobs_with_wood_in_doubt_are_in_sight AFTER UPDATE OF state ON allocations
WHEN NEW.state = 'suspect'
 AND (SELECT archived FROM archivings WHERE job = NEW.job ORDER BY id DESC LIMIT 1) = 1
BEGIN
  INSERT INTO archivings (job, archived, at) VALUES (NEW.job, 0, NEW.changed_at);
END;
