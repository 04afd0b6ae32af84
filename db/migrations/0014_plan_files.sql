-- Schema 14: what a plan says in full is a file beside the database, named by its SHA-256; its row keeps hash and size.

-- veneer_keep_plan writes the text to its file, whole and synced, and gives the hash. A file that is written before this
-- step is committed, and the step lost, is written again with the same content.
CREATE TEMP TABLE old_plans AS
SELECT id, name, parent, who, created_at, target_file, preview_file, veneer_keep_plan(plan_json) AS plan_sha256,
       length(CAST(plan_json AS BLOB)) AS plan_bytes, options_json, report_json
FROM main.plans;
CREATE TEMP TABLE last_plan AS SELECT seq FROM main.sqlite_sequence WHERE name = 'plans';
DROP TABLE main.plans;

CREATE TABLE plans (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  name         TEXT    NOT NULL,
  parent       INTEGER REFERENCES plans (id),
  who          TEXT    NOT NULL,
  created_at   TEXT    NOT NULL,
  target_file  TEXT    NOT NULL,
  preview_file TEXT    NOT NULL,
  plan_sha256  TEXT    NOT NULL CHECK (length(plan_sha256) = 64),  -- the published plan: plans/<plan_sha256>.json
  plan_bytes   INTEGER NOT NULL CHECK (plan_bytes >= 0),
  options_json TEXT    NOT NULL,
  report_json  TEXT    NOT NULL,  -- what planning said of it
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('plans', id, name, parent, who, created_at,
    target_file, preview_file, plan_sha256, plan_bytes, options_json, report_json)) STORED
) STRICT;
CREATE INDEX plans_of_file ON plans (plan_sha256);

INSERT INTO plans (id, name, parent, who, created_at, target_file, preview_file, plan_sha256, plan_bytes, options_json,
                   report_json)
SELECT id, name, parent, who, created_at, target_file, preview_file, plan_sha256, plan_bytes, options_json, report_json
FROM old_plans ORDER BY id;
-- The number of a plan that was removed is not handed out again.
DELETE FROM main.sqlite_sequence WHERE name = 'plans';
INSERT INTO main.sqlite_sequence (name, seq) SELECT 'plans', seq FROM last_plan;
DROP TABLE old_plans;
DROP TABLE last_plan;

CREATE TRIGGER plans_are_never_edited BEFORE UPDATE ON plans
BEGIN
  SELECT RAISE(ABORT, 'a plan is never edited');
END;
CREATE TRIGGER plans_of_jobs_are_kept BEFORE DELETE ON plans
WHEN veneer_writer() = 0 OR EXISTS (SELECT 1 FROM jobs WHERE plan = OLD.id)
BEGIN
  SELECT RAISE(ABORT, 'a plan that a job was made of is never removed');
END;
