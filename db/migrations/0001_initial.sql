-- Schema 1. docs/SCHEMA.md says what the tables mean; this file says what can never be in them.
-- Shapes are text: [[x,y],...] in whole micrometres for a ring or point list, a list of those for an area.

CREATE TABLE panels (
  number     INTEGER PRIMARY KEY AUTOINCREMENT,
  id         TEXT    NOT NULL UNIQUE CHECK (id = printf('P-%04d', number)),
  name       TEXT    NOT NULL,
  width_um   INTEGER NOT NULL CHECK (width_um > 0),
  height_um  INTEGER NOT NULL CHECK (height_um > 0),
  map_file   TEXT    NOT NULL,
  mask_file  TEXT    NOT NULL,
  map_hash   TEXT    NOT NULL,
  created_at TEXT    NOT NULL,
  parent     TEXT    REFERENCES panels (id),
  root       TEXT    NOT NULL REFERENCES panels (id)
) STRICT;

CREATE TRIGGER panels_keep_their_frame
BEFORE UPDATE OF number, id, width_um, height_um, created_at, parent, root ON panels
BEGIN
  SELECT RAISE(ABORT, 'the frame of a panel is fixed by its first scan');
END;

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
  taken_at TEXT NOT NULL
) STRICT;
CREATE INDEX scans_of_panel ON scans (panel);

CREATE TRIGGER scans_are_never_edited BEFORE UPDATE ON scans
BEGIN
  SELECT RAISE(ABORT, 'a scan is never edited');
END;

CREATE TABLE fiducials (
  panel      TEXT    NOT NULL REFERENCES panels (id),
  face       TEXT    NOT NULL CHECK (face IN ('show', 'back')),
  kind       TEXT    NOT NULL CHECK (kind IN ('tag', 'hole')),
  number     INTEGER NOT NULL,
  corners_um TEXT    NOT NULL,
  CHECK (json_array_length(corners_um) = CASE kind WHEN 'tag' THEN 4 ELSE 1 END),
  PRIMARY KEY (panel, face, kind, number)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER fiducials_are_frozen BEFORE UPDATE ON fiducials
BEGIN
  SELECT RAISE(ABORT, 'fiducials are frozen');
END;
CREATE TRIGGER fiducials_are_kept BEFORE DELETE ON fiducials
BEGIN
  SELECT RAISE(ABORT, 'fiducials are frozen');
END;

CREATE TABLE jobs (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  name         TEXT NOT NULL,
  state        TEXT NOT NULL CHECK (state IN ('planned', 'running', 'stopped', 'aborted', 'complete', 'cancelled')),
  created_at   TEXT NOT NULL,
  changed_at   TEXT NOT NULL,
  target_file  TEXT NOT NULL,
  preview_file TEXT NOT NULL,
  options_json TEXT NOT NULL,
  plan_json    TEXT NOT NULL
) STRICT;

CREATE TABLE job_moves (
  from_state TEXT NOT NULL,
  to_state   TEXT NOT NULL,
  PRIMARY KEY (from_state, to_state)
) STRICT, WITHOUT ROWID;
INSERT INTO job_moves VALUES
  ('planned', 'running'), ('planned', 'cancelled'),
  ('running', 'complete'), ('running', 'aborted'), ('running', 'stopped'),
  ('aborted', 'running'), ('aborted', 'cancelled'), ('aborted', 'complete'),
  ('stopped', 'running'), ('stopped', 'cancelled'), ('stopped', 'complete');

CREATE TRIGGER jobs_begin_planned BEFORE INSERT ON jobs WHEN NEW.state <> 'planned'
BEGIN
  SELECT RAISE(ABORT, 'a job begins as planned');
END;
CREATE TRIGGER jobs_move_as_allowed BEFORE UPDATE OF state ON jobs
WHEN NOT EXISTS (SELECT 1 FROM job_moves WHERE from_state = OLD.state AND to_state = NEW.state)
BEGIN
  SELECT RAISE(ABORT, 'a job does not move between these two states');
END;

CREATE TABLE pieces (
  id                 INTEGER PRIMARY KEY AUTOINCREMENT,
  job                INTEGER NOT NULL REFERENCES jobs (id),
  ordinal            INTEGER NOT NULL,
  mark               TEXT    NOT NULL CHECK (mark <> ''),
  artwork_outline_um TEXT    NOT NULL,
  panel              TEXT    REFERENCES panels (id),
  panel_outline_um   TEXT    NOT NULL,
  -- panel_from_artwork: p -> R(angle) * F * p + shift, F mirrors x when improper
  angle_rad          REAL    NOT NULL,
  shift_x_mm         REAL    NOT NULL,
  shift_y_mm         REAL    NOT NULL,
  improper           INTEGER NOT NULL CHECK (improper IN (0, 1)),
  UNIQUE (job, mark),
  UNIQUE (job, ordinal),
  UNIQUE (id, job)
) STRICT;

CREATE TRIGGER pieces_are_never_edited BEFORE UPDATE ON pieces
BEGIN
  SELECT RAISE(ABORT, 'a piece is never edited');
END;

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
  result      TEXT    NOT NULL
) STRICT;
CREATE INDEX runs_of_job ON runs (job);
CREATE UNIQUE INDEX one_run_at_a_time ON runs (ended_at IS NULL) WHERE ended_at IS NULL;

CREATE TRIGGER runs_belong_to_a_running_job BEFORE INSERT ON runs
WHEN NOT EXISTS (SELECT 1 FROM jobs WHERE id = NEW.job AND state = 'running')
BEGIN
  SELECT RAISE(ABORT, 'a run belongs to a running job');
END;
CREATE TRIGGER ended_runs_are_kept BEFORE UPDATE ON runs WHEN OLD.ended_at IS NOT NULL
BEGIN
  SELECT RAISE(ABORT, 'an ended run is never edited');
END;

-- The ledger.
CREATE TABLE allocations (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  panel      TEXT    NOT NULL REFERENCES panels (id),
  job        INTEGER REFERENCES jobs (id),
  piece      INTEGER,
  state      TEXT    NOT NULL CHECK (state IN ('reserved', 'cutting', 'cut', 'suspect', 'scrap', 'released')),
  outline_um TEXT    NOT NULL,
  area_um    TEXT    NOT NULL,
  reason     TEXT    NOT NULL,  -- of wood written off
  changed_at TEXT    NOT NULL,
  CHECK ((job IS NULL) = (piece IS NULL)),
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
  PRIMARY KEY (from_state, to_state)
) STRICT, WITHOUT ROWID;
INSERT INTO allocation_moves VALUES
  ('reserved', 'cutting'), ('reserved', 'released'),
  ('cutting', 'cut'), ('cutting', 'suspect'),
  ('suspect', 'cut'), ('suspect', 'scrap'), ('suspect', 'released'),
  ('cut', 'scrap');

CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, or written off as scrap');
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
CREATE TRIGGER allocations_keep_their_wood
BEFORE UPDATE OF id, panel, job, piece, outline_um, area_um, reason ON allocations
BEGIN
  SELECT RAISE(ABORT, 'the wood of an allocation never changes');
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
CREATE TRIGGER deleted_wood_leaves_the_tree AFTER DELETE ON allocations
BEGIN
  DELETE FROM allocation_boxes WHERE id = OLD.id;
END;

-- A run ends with every piece in a state that says what is known of it.
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

-- A piece's state is that of its newest allocation; a patch without wood has none.
CREATE VIEW piece_states AS
SELECT p.id AS piece, p.job AS job, p.ordinal AS ordinal,
       coalesce((SELECT a.state FROM allocations AS a WHERE a.job = p.job AND a.piece = p.id ORDER BY a.id DESC LIMIT 1),
                'unfilled') AS state
FROM pieces AS p;

CREATE TABLE certificates (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  kind       TEXT NOT NULL CHECK (kind IN ('scanner', 'camera', 'axes', 'kerf')),
  issued_at  TEXT NOT NULL,
  expires_at TEXT NOT NULL CHECK (expires_at > issued_at),
  rms_mm     REAL NOT NULL CHECK (rms_mm >= 0),
  payload    TEXT NOT NULL
) STRICT;
CREATE TRIGGER certificates_are_never_edited BEFORE UPDATE ON certificates
BEGIN
  SELECT RAISE(ABORT, 'a certificate is never edited');
END;

CREATE TABLE audit (
  id     INTEGER PRIMARY KEY AUTOINCREMENT,
  at     TEXT NOT NULL,
  who    TEXT NOT NULL,
  what   TEXT NOT NULL,
  detail TEXT NOT NULL
) STRICT;
CREATE TRIGGER audit_is_never_edited BEFORE UPDATE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
CREATE TRIGGER audit_is_never_shortened BEFORE DELETE ON audit
BEGIN
  SELECT RAISE(ABORT, 'the audit log is append-only');
END;
