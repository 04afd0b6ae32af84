-- Schema 6: every table anew. What is new:
--
-- * Every row carries a checksum of its other columns, in their order, and of its table's name. SQLite computes it with
--   veneer_checksum, so that no connection without that function can write; Database::check_integrity and the triggers
--   compare.
-- * A plan stands for itself. Its patches are the parts of the picture, its placements say where each one's wood is
--   taken from; a job makes pieces of the patches. A piece keeps its number when its patch is placed anew.
-- * Nothing that counts can be deleted.

DROP VIEW piece_states;
CREATE TEMP TABLE old_panels AS SELECT * FROM main.panels;
CREATE TEMP TABLE old_masks AS SELECT * FROM main.masks;
CREATE TEMP TABLE old_scans AS SELECT * FROM main.scans;
CREATE TEMP TABLE old_fiducials AS SELECT * FROM main.fiducials;
CREATE TEMP TABLE old_zones AS SELECT * FROM main.zones;
CREATE TEMP TABLE old_recipes AS SELECT * FROM main.recipes;
CREATE TEMP TABLE old_jobs AS SELECT * FROM main.jobs;
CREATE TEMP TABLE old_pieces AS SELECT * FROM main.pieces;
CREATE TEMP TABLE old_runs AS SELECT * FROM main.runs;
CREATE TEMP TABLE old_allocations AS SELECT * FROM main.allocations;
CREATE TEMP TABLE old_certificates AS SELECT * FROM main.certificates;
CREATE TEMP TABLE old_audit AS SELECT * FROM main.audit;
CREATE TEMP TABLE old_request_keys AS SELECT * FROM main.request_keys;

DROP TABLE main.allocation_boxes;
DROP TABLE main.allocations;
DROP TABLE main.allocation_moves;
DROP TABLE main.runs;
DROP TABLE main.pieces;
DROP TABLE main.job_moves;
DROP TABLE main.jobs;
DROP TABLE main.request_keys;
DROP TABLE main.audit;
DROP TABLE main.certificates;
DROP TABLE main.recipes;
DROP TABLE main.zones;
DROP TABLE main.fiducials;
DROP TABLE main.scans;
DROP TABLE main.masks;
DROP TABLE main.panels;

CREATE TABLE panels (
  number     INTEGER PRIMARY KEY AUTOINCREMENT,
  id         TEXT    NOT NULL UNIQUE CHECK (id = printf('P-%04d', number)),
  name       TEXT    NOT NULL,
  width_um   INTEGER NOT NULL CHECK (width_um > 0),
  height_um  INTEGER NOT NULL CHECK (height_um > 0),
  created_at TEXT    NOT NULL,
  parent     TEXT    REFERENCES panels (id),
  root       TEXT    NOT NULL REFERENCES panels (id),
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('panels', number, id, name, width_um, height_um,
    created_at, parent, root)) STORED
) STRICT;

-- What a panel's wood looked like, and which of it is usable. The highest version counts.
CREATE TABLE masks (
  panel     TEXT    NOT NULL REFERENCES panels (id),
  version   INTEGER NOT NULL CHECK (version > 0),
  map_file  TEXT    NOT NULL,
  mask_file TEXT    NOT NULL,
  map_hash  TEXT    NOT NULL,
  made_at   TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('masks', panel, version, map_file, mask_file,
    map_hash, made_at)) STORED,
  PRIMARY KEY (panel, version)
) STRICT, WITHOUT ROWID;

CREATE TABLE scans (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  panel    TEXT NOT NULL REFERENCES panels (id),
  face     TEXT NOT NULL CHECK (face IN ('show', 'back')),
  device   TEXT NOT NULL,
  file     TEXT NOT NULL,
  sha256   TEXT NOT NULL,
  dpi      REAL NOT NULL CHECK (dpi > 0),
  rms_mm   REAL CHECK (rms_mm >= 0),
  max_mm   REAL CHECK (max_mm >= 0),
  lattice  TEXT NOT NULL,
  taken_at TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('scans', id, panel, face, device, file, sha256, dpi,
    rms_mm, max_mm, lattice, taken_at)) STORED
) STRICT;
CREATE INDEX scans_of_panel ON scans (panel);

CREATE TABLE fiducials (
  panel      TEXT    NOT NULL REFERENCES panels (id),
  face       TEXT    NOT NULL CHECK (face IN ('show', 'back')),
  kind       TEXT    NOT NULL CHECK (kind IN ('tag', 'hole')),
  number     INTEGER NOT NULL,
  corners_um TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('fiducials', panel, face, kind, number, corners_um))
    STORED,
  CHECK (json_array_length(corners_um) = CASE kind WHEN 'tag' THEN 4 ELSE 1 END),
  PRIMARY KEY (panel, face, kind, number)
) STRICT, WITHOUT ROWID;

-- Strips of wood, as the panel's first scan showed them; a person says of which wood they are.
CREATE TABLE zones (
  panel      TEXT    NOT NULL REFERENCES panels (id),
  number     INTEGER NOT NULL CHECK (number > 0),
  outline_um TEXT    NOT NULL,
  material   TEXT    NOT NULL DEFAULT '',  -- '': nobody has said
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('zones', panel, number, outline_um, material)) STORED,
  PRIMARY KEY (panel, number)
) STRICT, WITHOUT ROWID;

-- One row for each operation on a material; a material without a row is burnt as the configuration says.
CREATE TABLE recipes (
  material     TEXT    NOT NULL CHECK (material <> ''),
  operation    TEXT    NOT NULL CHECK (operation IN ('cut', 'engrave')),
  speed_mm_s   REAL    NOT NULL CHECK (speed_mm_s > 0 AND speed_mm_s <= 1000),
  power        REAL    NOT NULL CHECK (power > 0 AND power <= 1),
  passes       INTEGER NOT NULL CHECK (passes BETWEEN 1 AND 20),
  air          INTEGER NOT NULL CHECK (air IN (0, 1)),
  -- Of a cut, full width; null: as the kerf certificate says.
  kerf_back_um INTEGER CHECK (kerf_back_um >= 0 AND kerf_back_um < 5000),
  kerf_show_um INTEGER CHECK (kerf_show_um >= 0 AND kerf_show_um < 5000),
  changed_at   TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('recipes', material, operation, speed_mm_s, power,
    passes, air, kerf_back_um, kerf_show_um, changed_at)) STORED,
  CHECK ((kerf_back_um IS NULL) = (kerf_show_um IS NULL)),
  CHECK (operation = 'cut' OR kerf_back_um IS NULL),
  PRIMARY KEY (material, operation)
) STRICT, WITHOUT ROWID;

-- One answer to the question which wood makes a picture. Never edited: other options make another plan, with the one
-- it was made from as its parent.
CREATE TABLE plans (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  name         TEXT NOT NULL,
  parent       INTEGER REFERENCES plans (id),
  who          TEXT NOT NULL,
  created_at   TEXT NOT NULL,
  target_file  TEXT NOT NULL,
  preview_file TEXT NOT NULL,
  plan_json    TEXT NOT NULL,  -- the published plan
  options_json TEXT NOT NULL,
  report_json  TEXT NOT NULL,  -- what planning said of it
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('plans', id, name, parent, who, created_at,
    target_file, preview_file, plan_json, options_json, report_json)) STORED
) STRICT;

-- What the plan takes for granted: its wood is reserved only while these versions count.
CREATE TABLE plan_panels (
  plan         INTEGER NOT NULL REFERENCES plans (id),
  panel        TEXT    NOT NULL,
  mask_version INTEGER NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('plan_panels', plan, panel, mask_version)) STORED,
  PRIMARY KEY (plan, panel),
  FOREIGN KEY (panel, mask_version) REFERENCES masks (panel, version)
) STRICT, WITHOUT ROWID;

-- A part of the picture, to be made of one piece of wood.
CREATE TABLE patches (
  id                 INTEGER PRIMARY KEY AUTOINCREMENT,
  plan               INTEGER NOT NULL REFERENCES plans (id),
  ordinal            INTEGER NOT NULL,
  mark               TEXT    NOT NULL CHECK (mark <> ''),
  artwork_outline_um TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('patches', id, plan, ordinal, mark,
    artwork_outline_um)) STORED,
  UNIQUE (plan, ordinal),
  UNIQUE (plan, mark)
) STRICT;

-- Where a plan takes a patch's wood from. A later plan may place a patch of an earlier one anew.
CREATE TABLE placements (
  id               INTEGER PRIMARY KEY AUTOINCREMENT,
  plan             INTEGER NOT NULL REFERENCES plans (id),
  patch            INTEGER NOT NULL REFERENCES patches (id),
  panel            TEXT    NOT NULL,
  panel_outline_um TEXT    NOT NULL,
  area_um          TEXT    NOT NULL,  -- the outline grown by k, and what its lead-in burns
  -- panel_from_artwork: p -> R(angle) * F * p + shift, F mirrors x when improper
  angle_rad        REAL    NOT NULL,
  shift_x_mm       REAL    NOT NULL,
  shift_y_mm       REAL    NOT NULL,
  improper         INTEGER NOT NULL CHECK (improper IN (0, 1)),
  lead_in_um       TEXT    NOT NULL,  -- a list of one point, where the cut begins in waste, or of none
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('placements', id, plan, patch, panel,
    panel_outline_um, area_um, angle_rad, shift_x_mm, shift_y_mm, improper, lead_in_um)) STORED,
  UNIQUE (plan, patch),
  FOREIGN KEY (plan, panel) REFERENCES plan_panels (plan, panel)
) STRICT;
CREATE INDEX placements_of_patch ON placements (patch);

CREATE TABLE jobs (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  name       TEXT    NOT NULL,
  plan       INTEGER NOT NULL REFERENCES plans (id),
  state      TEXT    NOT NULL CHECK (state IN ('planned', 'running', 'stopped', 'aborted', 'complete', 'cancelled')),
  created_at TEXT    NOT NULL,
  changed_at TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('jobs', id, name, plan, state, created_at,
    changed_at)) STORED
) STRICT;
CREATE INDEX jobs_of_plan ON jobs (plan);

CREATE TABLE job_moves (
  from_state TEXT NOT NULL,
  to_state   TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('job_moves', from_state, to_state)) STORED,
  PRIMARY KEY (from_state, to_state)
) STRICT, WITHOUT ROWID;

-- A patch that a job makes: its number is global and stays, wherever the wood is taken from.
CREATE TABLE pieces (
  id    INTEGER PRIMARY KEY AUTOINCREMENT,
  job   INTEGER NOT NULL REFERENCES jobs (id),
  patch INTEGER NOT NULL REFERENCES patches (id),
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('pieces', id, job, patch)) STORED,
  UNIQUE (job, patch),
  UNIQUE (id, job)
) STRICT;

-- A run cuts one panel of a job. The cell has one laser, so one run is on at a time.
CREATE TABLE runs (
  id          INTEGER PRIMARY KEY AUTOINCREMENT,
  job         INTEGER NOT NULL REFERENCES jobs (id),
  panel       TEXT    NOT NULL REFERENCES panels (id),
  -- bed_from_panel, as above
  angle_rad   REAL    NOT NULL,
  shift_x_mm  REAL    NOT NULL,
  shift_y_mm  REAL    NOT NULL,
  improper    INTEGER NOT NULL CHECK (improper IN (0, 1)),
  pose_rms_mm REAL    NOT NULL CHECK (pose_rms_mm >= 0),
  started_at  TEXT    NOT NULL,
  ended_at    TEXT,
  result      TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('runs', id, job, panel, angle_rad, shift_x_mm,
    shift_y_mm, improper, pose_rms_mm, started_at, ended_at, result)) STORED
) STRICT;
CREATE INDEX runs_of_job ON runs (job);
CREATE UNIQUE INDEX one_run_at_a_time ON runs (ended_at IS NULL) WHERE ended_at IS NULL;

-- The ledger: wood of a panel that is held for a piece, or written off.
CREATE TABLE allocations (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  panel      TEXT    NOT NULL REFERENCES panels (id),
  job        INTEGER REFERENCES jobs (id),
  piece      INTEGER,
  placement  INTEGER REFERENCES placements (id),
  state      TEXT    NOT NULL CHECK (state IN ('reserved', 'cutting', 'cut', 'suspect', 'scrap', 'released')),
  area_um    TEXT    NOT NULL,
  reason     TEXT    NOT NULL,  -- of wood written off
  changed_at TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('allocations', id, panel, job, piece, placement,
    state, area_um, reason, changed_at)) STORED,
  CHECK ((job IS NULL) = (piece IS NULL) AND (job IS NULL) = (placement IS NULL)),
  FOREIGN KEY (piece, job) REFERENCES pieces (id, job)
) STRICT;
CREATE INDEX allocations_of_panel ON allocations (panel);
CREATE INDEX allocations_of_job ON allocations (job, piece);
CREATE UNIQUE INDEX one_piece_of_wood_per_piece ON allocations (piece) WHERE state NOT IN ('released', 'scrap');

-- Bounding boxes of the live allocations; the third dimension is the panel's number.
CREATE VIRTUAL TABLE allocation_boxes
USING rtree_i32 (id, min_panel, max_panel, min_x, max_x, min_y, max_y);

CREATE TABLE allocation_moves (
  from_state TEXT NOT NULL,
  to_state   TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('allocation_moves', from_state, to_state)) STORED,
  PRIMARY KEY (from_state, to_state)
) STRICT, WITHOUT ROWID;

CREATE TABLE certificates (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  kind       TEXT NOT NULL CHECK (kind IN ('scanner', 'camera', 'axes', 'kerf')),
  issued_at  TEXT NOT NULL,
  expires_at TEXT NOT NULL CHECK (expires_at > issued_at),
  rms_mm     REAL NOT NULL CHECK (rms_mm >= 0),
  payload    TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('certificates', id, kind, issued_at, expires_at,
    rms_mm, payload)) STORED
) STRICT;

CREATE TABLE audit (
  id     INTEGER PRIMARY KEY AUTOINCREMENT,
  at     TEXT NOT NULL,
  who    TEXT NOT NULL,
  what   TEXT NOT NULL,
  detail TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('audit', id, at, who, what, detail)) STORED
) STRICT;

-- Requests made under a key of the caller's (Idempotency-Key), so that a repeated one is answered, not done again.
CREATE TABLE request_keys (
  who          TEXT NOT NULL,
  operation    TEXT NOT NULL,
  key          TEXT NOT NULL CHECK (key <> ''),
  request_hash TEXT NOT NULL,
  reply        TEXT,  -- what was answered at once
  result       TEXT,  -- what came of it, written together with it
  at           TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('request_keys', who, operation, key, request_hash,
    reply, result, at)) STORED,
  PRIMARY KEY (who, operation, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX request_keys_by_age ON request_keys (at);

INSERT INTO panels (number, id, name, width_um, height_um, created_at, parent, root)
SELECT number, id, name, width_um, height_um, created_at, parent, root FROM old_panels;
INSERT INTO masks (panel, version, map_file, mask_file, map_hash, made_at)
SELECT panel, version, map_file, mask_file, map_hash, made_at FROM old_masks;
INSERT INTO scans (id, panel, face, device, file, sha256, dpi, rms_mm, max_mm, lattice, taken_at)
SELECT id, panel, face, device, file, sha256, dpi, rms_mm, max_mm, lattice, taken_at FROM old_scans;
INSERT INTO fiducials (panel, face, kind, number, corners_um)
SELECT panel, face, kind, number, corners_um FROM old_fiducials;
INSERT INTO zones (panel, number, outline_um, material)
SELECT panel, number, outline_um, material FROM old_zones;
INSERT INTO recipes (material, operation, speed_mm_s, power, passes, air, kerf_back_um, kerf_show_um, changed_at)
SELECT material, operation, speed_mm_s, power, passes, air, kerf_back_um, kerf_show_um, changed_at FROM old_recipes;
-- Each job had a plan of its own; what was numbered as a piece numbers its patch and its placement too.
INSERT INTO plans (id, name, who, created_at, target_file, preview_file, plan_json, options_json,
  report_json)
SELECT id, name, 'veneerd', created_at, target_file, preview_file, plan_json, options_json, '{}' FROM old_jobs;
INSERT INTO plan_panels (plan, panel, mask_version)
SELECT DISTINCT p.job, p.panel, (SELECT max(version) FROM masks WHERE panel = p.panel)
FROM old_pieces AS p WHERE p.panel IS NOT NULL;
INSERT INTO patches (id, plan, ordinal, mark, artwork_outline_um)
SELECT id, job, ordinal, mark, artwork_outline_um FROM old_pieces;
INSERT INTO placements (id, plan, patch, panel, panel_outline_um, area_um, angle_rad, shift_x_mm, shift_y_mm, improper,
                        lead_in_um)
SELECT id, job, id, panel, panel_outline_um, (SELECT area_um FROM old_allocations WHERE piece = p.id ORDER BY id LIMIT
  1),
       angle_rad, shift_x_mm, shift_y_mm, improper, lead_in_um
FROM old_pieces AS p WHERE panel IS NOT NULL;
INSERT INTO jobs (id, name, plan, state, created_at, changed_at)
SELECT id, name, id, state, created_at, changed_at FROM old_jobs;
INSERT INTO pieces (id, job, patch) SELECT id, job, id FROM old_pieces;
INSERT INTO runs (id, job, panel, angle_rad, shift_x_mm, shift_y_mm, improper, pose_rms_mm, started_at, ended_at,
  result)
SELECT id, job, panel, angle_rad, shift_x_mm, shift_y_mm, improper, pose_rms_mm, started_at, ended_at, result FROM
  old_runs;
INSERT INTO allocations (id, panel, job, piece, placement, state, area_um, reason, changed_at)
SELECT id, panel, job, piece, piece, state, area_um, reason, changed_at FROM old_allocations;
INSERT INTO allocation_boxes
SELECT a.id, p.number, p.number, veneer_box(a.area_um, 0), veneer_box(a.area_um, 1), veneer_box(a.area_um, 2),
       veneer_box(a.area_um, 3)
FROM allocations AS a JOIN panels AS p ON p.id = a.panel WHERE a.state <> 'released';
INSERT INTO certificates (id, kind, issued_at, expires_at, rms_mm, payload)
SELECT id, kind, issued_at, expires_at, rms_mm, payload FROM old_certificates;
INSERT INTO audit (id, at, who, what, detail)
SELECT id, at, who, what, detail FROM old_audit;
INSERT INTO request_keys (who, operation, key, request_hash, reply, result, at)
SELECT who, operation, key, request_hash, reply, result, at FROM old_request_keys;
INSERT INTO job_moves (from_state, to_state) VALUES
  ('planned', 'running'), ('planned', 'cancelled'),
  ('running', 'complete'), ('running', 'aborted'), ('running', 'stopped'),
  ('aborted', 'running'), ('aborted', 'cancelled'), ('aborted', 'complete'),
  ('stopped', 'running'), ('stopped', 'cancelled'), ('stopped', 'complete');
INSERT INTO allocation_moves (from_state, to_state) VALUES
  ('reserved', 'cutting'), ('reserved', 'released'),
  ('cutting', 'cut'), ('cutting', 'suspect'),
  ('suspect', 'cut'), ('suspect', 'scrap'), ('suspect', 'released'),
  ('cut', 'scrap'),
  ('reserved', 'suspect'), ('cut', 'suspect');  -- a beam may have strayed onto them

DROP TABLE temp.old_panels;
DROP TABLE temp.old_masks;
DROP TABLE temp.old_scans;
DROP TABLE temp.old_fiducials;
DROP TABLE temp.old_zones;
DROP TABLE temp.old_recipes;
DROP TABLE temp.old_jobs;
DROP TABLE temp.old_pieces;
DROP TABLE temp.old_runs;
DROP TABLE temp.old_allocations;
DROP TABLE temp.old_certificates;
DROP TABLE temp.old_audit;
DROP TABLE temp.old_request_keys;

-- What may be changed must be as it was written.
CREATE TRIGGER panels_are_sound BEFORE UPDATE ON panels
WHEN OLD.checksum <> veneer_checksum('panels', OLD.number, OLD.id, OLD.name, OLD.width_um, OLD.height_um,
  OLD.created_at, OLD.parent, OLD.root)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER zones_are_sound BEFORE UPDATE ON zones
WHEN OLD.checksum <> veneer_checksum('zones', OLD.panel, OLD.number, OLD.outline_um, OLD.material)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER recipes_are_sound BEFORE UPDATE ON recipes
WHEN OLD.checksum <> veneer_checksum('recipes', OLD.material, OLD.operation, OLD.speed_mm_s, OLD.power, OLD.passes,
  OLD.air, OLD.kerf_back_um, OLD.kerf_show_um, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER jobs_are_sound BEFORE UPDATE ON jobs
WHEN OLD.checksum <> veneer_checksum('jobs', OLD.id, OLD.name, OLD.plan, OLD.state, OLD.created_at, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER runs_are_sound BEFORE UPDATE ON runs
WHEN OLD.checksum <> veneer_checksum('runs', OLD.id, OLD.job, OLD.panel, OLD.angle_rad, OLD.shift_x_mm, OLD.shift_y_mm,
  OLD.improper, OLD.pose_rms_mm, OLD.started_at, OLD.ended_at, OLD.result)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER allocations_are_sound BEFORE UPDATE ON allocations
WHEN OLD.checksum <> veneer_checksum('allocations', OLD.id, OLD.panel, OLD.job, OLD.piece, OLD.placement, OLD.state,
  OLD.area_um, OLD.reason, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER request_keys_are_sound BEFORE UPDATE ON request_keys
WHEN OLD.checksum <> veneer_checksum('request_keys', OLD.who, OLD.operation, OLD.key, OLD.request_hash, OLD.reply,
  OLD.result, OLD.at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
-- What never changes.
CREATE TRIGGER masks_are_never_edited BEFORE UPDATE ON masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never edited');
END;
CREATE TRIGGER scans_are_never_edited BEFORE UPDATE ON scans
BEGIN
  SELECT RAISE(ABORT, 'a scan is never edited');
END;
CREATE TRIGGER fiducials_are_never_edited BEFORE UPDATE ON fiducials
BEGIN
  SELECT RAISE(ABORT, 'fiducials are frozen');
END;
CREATE TRIGGER plans_are_never_edited BEFORE UPDATE ON plans
BEGIN
  SELECT RAISE(ABORT, 'a plan is never edited');
END;
CREATE TRIGGER plan_panels_are_never_edited BEFORE UPDATE ON plan_panels
BEGIN
  SELECT RAISE(ABORT, 'a plan is never edited');
END;
CREATE TRIGGER patches_are_never_edited BEFORE UPDATE ON patches
BEGIN
  SELECT RAISE(ABORT, 'a plan is never edited');
END;
CREATE TRIGGER placements_are_never_edited BEFORE UPDATE ON placements
BEGIN
  SELECT RAISE(ABORT, 'a plan is never edited');
END;
CREATE TRIGGER pieces_are_never_edited BEFORE UPDATE ON pieces
BEGIN
  SELECT RAISE(ABORT, 'a piece is never edited');
END;
CREATE TRIGGER certificates_are_never_edited BEFORE UPDATE ON certificates
BEGIN
  SELECT RAISE(ABORT, 'a certificate is never edited');
END;
CREATE TRIGGER audit_is_never_edited BEFORE UPDATE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
CREATE TRIGGER job_moves_are_never_edited BEFORE UPDATE ON job_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of a job are fixed');
END;
CREATE TRIGGER allocation_moves_are_never_edited BEFORE UPDATE ON allocation_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of wood are fixed');
END;
CREATE TRIGGER panels_keep_their_frame BEFORE UPDATE OF number, id, width_um, height_um, created_at, parent, root ON
  panels
BEGIN
  SELECT RAISE(ABORT, 'the frame of a panel is fixed by its first scan');
END;
CREATE TRIGGER zones_keep_their_wood BEFORE UPDATE OF panel, number, outline_um ON zones
BEGIN
  SELECT RAISE(ABORT, 'the outline of a zone never changes');
END;
CREATE TRIGGER jobs_keep_their_plan BEFORE UPDATE OF id, name, plan, created_at ON jobs
BEGIN
  SELECT RAISE(ABORT, 'the plan of a job never changes');
END;
CREATE TRIGGER ended_runs_are_kept BEFORE UPDATE ON runs
WHEN OLD.ended_at IS NOT NULL
BEGIN
  SELECT RAISE(ABORT, 'an ended run is never edited');
END;
CREATE TRIGGER runs_keep_their_pose BEFORE UPDATE OF id, job, panel, angle_rad, shift_x_mm, shift_y_mm, improper,
  pose_rms_mm, started_at ON runs
BEGIN
  SELECT RAISE(ABORT, 'the pose of a run never changes');
END;
CREATE TRIGGER allocations_keep_their_wood BEFORE UPDATE OF id, panel, job, piece, placement, area_um, reason ON
  allocations
BEGIN
  SELECT RAISE(ABORT, 'the wood of an allocation never changes');
END;
-- What is never removed; a row that takes the place of another removes it too (PRAGMA recursive_triggers).
CREATE TRIGGER panels_are_kept BEFORE DELETE ON panels
BEGIN
  SELECT RAISE(ABORT, 'a panel is never removed');
END;
CREATE TRIGGER masks_are_kept BEFORE DELETE ON masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never removed');
END;
CREATE TRIGGER scans_are_kept BEFORE DELETE ON scans
BEGIN
  SELECT RAISE(ABORT, 'a scan is never removed');
END;
CREATE TRIGGER fiducials_are_kept BEFORE DELETE ON fiducials
BEGIN
  SELECT RAISE(ABORT, 'fiducials are frozen');
END;
CREATE TRIGGER zones_are_kept BEFORE DELETE ON zones
BEGIN
  SELECT RAISE(ABORT, 'a zone is never removed');
END;
CREATE TRIGGER jobs_are_kept BEFORE DELETE ON jobs
BEGIN
  SELECT RAISE(ABORT, 'a job is never removed');
END;
CREATE TRIGGER pieces_are_kept BEFORE DELETE ON pieces
BEGIN
  SELECT RAISE(ABORT, 'a piece is never removed');
END;
CREATE TRIGGER runs_are_kept BEFORE DELETE ON runs
BEGIN
  SELECT RAISE(ABORT, 'a run is never removed');
END;
CREATE TRIGGER allocations_are_kept BEFORE DELETE ON allocations
BEGIN
  SELECT RAISE(ABORT, 'wood is released, never forgotten');
END;
CREATE TRIGGER certificates_are_kept BEFORE DELETE ON certificates
BEGIN
  SELECT RAISE(ABORT, 'a certificate is never removed');
END;
CREATE TRIGGER audit_is_never_shortened BEFORE DELETE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
CREATE TRIGGER job_moves_are_kept BEFORE DELETE ON job_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of a job are fixed');
END;
CREATE TRIGGER allocation_moves_are_kept BEFORE DELETE ON allocation_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of wood are fixed');
END;
CREATE TRIGGER plans_of_jobs_are_kept BEFORE DELETE ON plans
WHEN veneer_writer() = 0 OR EXISTS (SELECT 1 FROM jobs WHERE plan = OLD.id)
BEGIN
  SELECT RAISE(ABORT, 'a plan that a job was made of is never removed');
END;
CREATE TRIGGER plan_panels_of_jobs_are_kept BEFORE DELETE ON plan_panels
WHEN veneer_writer() = 0 OR EXISTS (SELECT 1 FROM jobs WHERE plan = OLD.plan)
BEGIN
  SELECT RAISE(ABORT, 'a plan that a job was made of is never removed');
END;
CREATE TRIGGER patches_of_jobs_are_kept BEFORE DELETE ON patches
WHEN veneer_writer() = 0 OR EXISTS (SELECT 1 FROM jobs WHERE plan = OLD.plan)
BEGIN
  SELECT RAISE(ABORT, 'a plan that a job was made of is never removed');
END;
CREATE TRIGGER placements_of_jobs_are_kept BEFORE DELETE ON placements
WHEN veneer_writer() = 0 OR EXISTS (SELECT 1 FROM jobs WHERE plan = OLD.plan) OR EXISTS (SELECT 1 FROM allocations
  WHERE placement = OLD.id)
BEGIN
  SELECT RAISE(ABORT, 'a plan that a job was made of is never removed');
END;
CREATE TRIGGER recipes_are_removed_by_veneerd BEFORE DELETE ON recipes
WHEN veneer_writer() = 0
BEGIN
  SELECT RAISE(ABORT, 'only veneerd removes recipes');
END;
CREATE TRIGGER request_keys_are_removed_by_veneerd BEFORE DELETE ON request_keys
WHEN veneer_writer() = 0
BEGIN
  SELECT RAISE(ABORT, 'only veneerd removes keys');
END;
-- Jobs.
CREATE TRIGGER job_moves_are_complete BEFORE INSERT ON job_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of a job are fixed');
END;
CREATE TRIGGER allocation_moves_are_complete BEFORE INSERT ON allocation_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of wood are fixed');
END;
CREATE TRIGGER jobs_begin_planned BEFORE INSERT ON jobs
WHEN NEW.state <> 'planned'
BEGIN
  SELECT RAISE(ABORT, 'a job begins as planned');
END;
CREATE TRIGGER jobs_move_as_allowed BEFORE UPDATE OF state ON jobs
WHEN NOT EXISTS (SELECT 1 FROM job_moves WHERE from_state = OLD.state AND to_state = NEW.state)
BEGIN
  SELECT RAISE(ABORT, 'a job does not move between these two states');
END;
CREATE TRIGGER pieces_are_of_their_jobs_plan BEFORE INSERT ON pieces
WHEN NOT EXISTS (SELECT 1 FROM jobs AS j JOIN patches AS t ON t.plan = j.plan WHERE j.id = NEW.job AND t.id = NEW.patch)
BEGIN
  SELECT RAISE(ABORT, 'a piece is a patch of its job''s plan');
END;
CREATE TRIGGER runs_belong_to_a_running_job BEFORE INSERT ON runs
WHEN NOT EXISTS (SELECT 1 FROM jobs WHERE id = NEW.job AND state = 'running')
BEGIN
  SELECT RAISE(ABORT, 'a run belongs to a running job');
END;
CREATE TRIGGER runs_leave_nothing_cutting BEFORE UPDATE OF ended_at ON runs
WHEN NEW.ended_at IS NOT NULL
 AND EXISTS (SELECT 1 FROM allocations WHERE job = NEW.job AND state = 'cutting')
BEGIN
  SELECT RAISE(ABORT, 'a run cannot end while a piece is being cut');
END;
CREATE TRIGGER jobs_leave_no_run_open BEFORE UPDATE OF state ON jobs
WHEN OLD.state = 'running' AND EXISTS (SELECT 1 FROM runs WHERE job = OLD.id AND ended_at IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'a job cannot end while its run is on');
END;
-- The ledger.
CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, or written off as scrap');
END;
CREATE TRIGGER allocations_are_where_the_piece_is_placed BEFORE INSERT ON allocations
WHEN NEW.piece IS NOT NULL AND NOT EXISTS (
  SELECT 1 FROM placements AS l JOIN pieces AS p ON p.patch = l.patch
  WHERE l.id = NEW.placement AND p.id = NEW.piece AND l.panel = NEW.panel AND l.area_um = NEW.area_um)
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved where its piece is placed');
END;
-- veneer_box(area, i): the i-th of min x, max x, min y, max y. veneer_areas_overlap: more than touching borders.
CREATE TRIGGER allocations_never_overlap BEFORE INSERT ON allocations
WHEN EXISTS (
  SELECT 1
  FROM panels AS p
  JOIN allocation_boxes AS b
    ON b.min_panel = p.number
   AND b.min_x < veneer_box(NEW.area_um, 1) AND b.max_x > veneer_box(NEW.area_um, 0)
   AND b.min_y < veneer_box(NEW.area_um, 3) AND b.max_y > veneer_box(NEW.area_um, 2)
  JOIN allocations AS a ON a.id = b.id
  WHERE p.id = NEW.panel AND veneer_areas_overlap(a.area_um, NEW.area_um))
BEGIN
  SELECT RAISE(ABORT, 'this wood is already allocated');
END;
CREATE TRIGGER allocations_enter_the_tree AFTER INSERT ON allocations
BEGIN
  INSERT INTO allocation_boxes
  SELECT NEW.id, number, number, veneer_box(NEW.area_um, 0), veneer_box(NEW.area_um, 1),
         veneer_box(NEW.area_um, 2), veneer_box(NEW.area_um, 3)
  FROM panels WHERE id = NEW.panel;
END;
CREATE TRIGGER allocations_move_as_allowed BEFORE UPDATE OF state ON allocations
WHEN NOT EXISTS (SELECT 1 FROM allocation_moves WHERE from_state = OLD.state AND to_state = NEW.state)
BEGIN
  SELECT RAISE(ABORT, 'wood does not move between these two states');
END;
CREATE TRIGGER wood_is_cut_in_a_run BEFORE UPDATE OF state ON allocations
WHEN NEW.state = 'cutting'
 AND NOT EXISTS (SELECT 1 FROM runs WHERE job = NEW.job AND panel = NEW.panel AND ended_at IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'wood is cut only while its job runs on its panel');
END;
CREATE TRIGGER released_wood_leaves_the_tree AFTER UPDATE OF state ON allocations WHEN NEW.state = 'released'
BEGIN
  DELETE FROM allocation_boxes WHERE id = NEW.id;
END;

-- A piece is where its newest allocation's placement is, in that allocation's state; without one it is unfilled.
CREATE VIEW piece_states AS
SELECT p.id AS piece, p.job AS job, t.ordinal AS ordinal, t.mark AS mark, a.id AS allocation, a.placement AS placement,
       coalesce(a.state, 'unfilled') AS state
FROM pieces AS p
JOIN patches AS t ON t.id = p.patch
LEFT JOIN allocations AS a ON a.id = (SELECT max(id) FROM allocations WHERE job = p.job AND piece = p.id);
