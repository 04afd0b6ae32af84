-- Schema 39: in which order the jobs that wait are cut, as people said.

-- The newest row counts. Jobs that it does not name stand behind those it names, in the order of their numbers, and
-- without a row all do. Jobs of its list that do not wait are passed over: they have their place when they do again.
CREATE TABLE queue_orders (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  job      INTEGER NOT NULL REFERENCES jobs (id),  -- that was put elsewhere
  jobs     TEXT    NOT NULL,                       -- how all with pieces to cut, being cut or suspect stood then: a JSON list of numbers
  who      TEXT    NOT NULL CHECK (who <> ''),
  at       TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('queue_orders', id, job, jobs, who, at)) STORED
) STRICT;

CREATE TRIGGER queue_orders_are_never_edited BEFORE UPDATE ON queue_orders
BEGIN
  SELECT RAISE(ABORT, 'in which order jobs stood is never edited');
END;
CREATE TRIGGER queue_orders_are_kept BEFORE DELETE ON queue_orders
BEGIN
  SELECT RAISE(ABORT, 'in which order jobs stood is never removed');
END;
CREATE TRIGGER queue_orders_name_each_job_once BEFORE INSERT ON queue_orders
WHEN json_type(NEW.jobs) <> 'array'
  OR EXISTS (SELECT 1 FROM json_each(NEW.jobs) WHERE type <> 'integer' OR value NOT IN (SELECT id FROM jobs))
  OR (SELECT count(*) <> count(DISTINCT value) OR total(value = NEW.job) <> 1 FROM json_each(NEW.jobs))
BEGIN
  SELECT RAISE(ABORT, 'an order names each job once, and the one that was moved');
END;
