-- Schema 23: the wood of a piece is told apart, remnants are booked, and cuts can be met again after a restart.

-- The ledger anew: of what is held for a piece, the piece itself and what its lead-in burns, each on its own; the rest
-- of its wood is kerf (allocation_parts). Wood that was carried over has its outline here, too. The index of wood stays
-- as it is, because no number changes.
CREATE TEMP TABLE old_allocations AS SELECT * FROM main.allocations;
CREATE TEMP TABLE old_carried AS SELECT * FROM main.carried;
DROP TABLE main.carried;
DROP TABLE main.allocations;

CREATE TABLE allocations (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  panel      TEXT    NOT NULL REFERENCES panels (id),
  job        INTEGER REFERENCES jobs (id),
  piece      INTEGER,
  placement  INTEGER REFERENCES placements (id),
  lease      INTEGER REFERENCES leases (id),
  state      TEXT    NOT NULL
             CHECK (state IN ('leased', 'reserved', 'cutting', 'cut', 'suspect', 'scrap', 'released')),
  area_um    TEXT    NOT NULL,                -- all of it: what nobody else may use
  outline_um TEXT    NOT NULL DEFAULT '~',    -- of that the piece, its points in the order of its patch's
  lead_in_um TEXT    NOT NULL DEFAULT '~',    -- and what is burnt where the cut begins, beyond the band of kerf
  reason     TEXT    NOT NULL,  -- of wood written off
  changed_at TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('allocations', id, panel, job, piece, placement,
    lease, state, area_um, outline_um, lead_in_um, reason, changed_at)) STORED,
  CHECK ((job IS NULL) = (piece IS NULL) AND (job IS NULL) = (placement IS NULL)),
  CHECK (job IS NULL OR lease IS NULL),
  CHECK (CASE WHEN lease IS NULL THEN state <> 'leased' ELSE state IN ('leased', 'released') END),
  CHECK (outline_um <> '~' OR (piece IS NULL AND lead_in_um = '~')),
  CHECK (outline_um = '~' OR lease IS NULL),
  FOREIGN KEY (piece, job) REFERENCES pieces (id, job)
) STRICT;
CREATE INDEX allocations_of_panel ON allocations (panel);
CREATE INDEX allocations_of_job ON allocations (job, piece);
CREATE INDEX allocations_of_lease ON allocations (lease) WHERE lease IS NOT NULL;
CREATE UNIQUE INDEX one_piece_of_wood_per_piece ON allocations (piece) WHERE state NOT IN ('released', 'scrap');

INSERT INTO allocations (id, panel, job, piece, placement, lease, state, area_um, outline_um, lead_in_um, reason,
                         changed_at)
SELECT a.id, a.panel, a.job, a.piece, a.placement, a.lease, a.state, a.area_um,
       veneer_outline(coalesce(l.panel_outline_um, c.outline_um, '[]')),
       CASE WHEN l.lead_in_um = '[]' THEN '~'
            ELSE veneer_lead_in(a.area_um, coalesce(l.panel_outline_um, c.outline_um, '[]')) END,
       a.reason, a.changed_at
FROM temp.old_allocations AS a LEFT JOIN placements AS l ON l.id = a.placement
LEFT JOIN temp.old_carried AS c ON c.allocation = a.id ORDER BY a.id;

CREATE TRIGGER allocations_are_sound BEFORE UPDATE ON allocations
WHEN OLD.checksum <> veneer_checksum('allocations', OLD.id, OLD.panel, OLD.job, OLD.piece, OLD.placement, OLD.lease,
  OLD.state, OLD.area_um, OLD.outline_um, OLD.lead_in_um, OLD.reason, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER allocations_keep_their_wood BEFORE UPDATE OF id, panel, job, piece, placement, lease, area_um, outline_um,
  lead_in_um, reason ON allocations
BEGIN
  SELECT RAISE(ABORT, 'the wood of an allocation never changes');
END;
CREATE TRIGGER allocations_are_kept BEFORE DELETE ON allocations
BEGIN
  SELECT RAISE(ABORT, 'wood is released, never forgotten');
END;
CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.lease IS NOT NULL THEN 'leased' WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
 AND NOT (NEW.state = 'cut' AND NEW.piece IS NULL AND NEW.lease IS NULL
          AND (EXISTS (SELECT 1 FROM parts WHERE panel = NEW.panel)
               OR EXISTS (SELECT 1 FROM merges WHERE kept = NEW.panel)))
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, leased, or written off as scrap');
END;
CREATE TRIGGER allocations_are_where_the_piece_is_placed BEFORE INSERT ON allocations
WHEN NEW.piece IS NOT NULL AND NOT EXISTS (
  SELECT 1 FROM placements AS l JOIN pieces AS p ON p.patch = l.patch
  WHERE l.id = NEW.placement AND p.id = NEW.piece AND l.panel = NEW.panel AND l.area_um = NEW.area_um
    AND veneer_outline(l.panel_outline_um) = NEW.outline_um AND (l.lead_in_um <> '[]' OR NEW.lead_in_um = '~'))
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved where its piece is placed');
END;
CREATE TRIGGER wood_without_a_piece_is_one BEFORE INSERT ON allocations
WHEN NEW.piece IS NULL AND NEW.outline_um <> '~'
 AND NOT EXISTS (SELECT 1 FROM parts WHERE panel = NEW.panel)
 AND NOT EXISTS (SELECT 1 FROM merges WHERE kept = NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'only wood of a piece has an outline');
END;
CREATE TRIGGER wood_is_leased_under_a_lease BEFORE INSERT ON allocations
WHEN NEW.lease IS NOT NULL AND NOT EXISTS (SELECT 1 FROM leases WHERE id = NEW.lease AND ended IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'wood is leased under a lease that lasts');
END;
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
CREATE TRIGGER wood_of_retired_panels_is_not_reserved BEFORE INSERT ON allocations
WHEN (SELECT retired FROM retirements WHERE panel = NEW.panel ORDER BY id DESC LIMIT 1) = 1
BEGIN
  SELECT RAISE(ABORT, 'this panel was retired');
END;
CREATE TRIGGER allocations_enter_the_tree AFTER INSERT ON allocations
BEGIN
  INSERT INTO allocation_boxes
  SELECT NEW.id, number, number, veneer_box(NEW.area_um, 0), veneer_box(NEW.area_um, 1),
         veneer_box(NEW.area_um, 2), veneer_box(NEW.area_um, 3)
  FROM panels WHERE id = NEW.panel;
END;
CREATE TRIGGER wood_that_enters_is_noted AFTER INSERT ON allocations
BEGIN
  INSERT INTO allocation_history (allocation, state, at) VALUES (NEW.id, NEW.state, NEW.changed_at);
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
CREATE TRIGGER leased_wood_is_released_with_its_lease BEFORE UPDATE OF state ON allocations
WHEN OLD.state = 'leased' AND EXISTS (SELECT 1 FROM leases WHERE id = OLD.lease AND ended IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'leased wood is released when its lease ends');
END;
CREATE TRIGGER released_wood_leaves_the_tree AFTER UPDATE OF state ON allocations WHEN NEW.state = 'released'
BEGIN
  DELETE FROM allocation_boxes WHERE id = NEW.id;
END;
CREATE TRIGGER wood_that_moves_is_noted AFTER UPDATE OF state ON allocations
BEGIN
  INSERT INTO allocation_history (allocation, state, at, run)
  VALUES (NEW.id, NEW.state, NEW.changed_at,
          (SELECT id FROM runs WHERE ended_at IS NULL AND job = NEW.job AND panel = NEW.panel));
END;
CREATE TRIGGER jobs_with_wood_in_doubt_are_in_sight AFTER UPDATE OF state ON allocations
WHEN NEW.state = 'suspect'
 AND (SELECT archived FROM archivings WHERE job = NEW.job ORDER BY id DESC LIMIT 1) = 1
BEGIN
  INSERT INTO archivings (job, archived, at) VALUES (NEW.job, 0, NEW.changed_at);
END;

-- The wood of each piece by what becomes of it when it is cut.
CREATE VIEW allocation_parts AS
SELECT id AS allocation, panel, state, outline_um, veneer_kerf(area_um, outline_um, lead_in_um) AS kerf_um, lead_in_um
FROM allocations WHERE outline_um <> '~';

CREATE TABLE carried (
  allocation INTEGER PRIMARY KEY REFERENCES allocations (id),
  origin     INTEGER NOT NULL REFERENCES allocations (id),
  checksum   INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('carried', allocation, origin)) STORED
) STRICT;
CREATE INDEX carried_of ON carried (origin);
INSERT INTO carried (allocation, origin) SELECT allocation, origin FROM temp.old_carried ORDER BY allocation;
DROP TABLE temp.old_allocations;
DROP TABLE temp.old_carried;

CREATE TRIGGER carried_wood_stays BEFORE UPDATE OF state ON allocations
WHEN EXISTS (SELECT 1 FROM carried WHERE allocation = OLD.id)
BEGIN
  SELECT RAISE(ABORT, 'this wood was gone before its panel was sawn off');
END;
CREATE TRIGGER carried_wood_is_never_edited BEFORE UPDATE ON carried
BEGIN
  SELECT RAISE(ABORT, 'from where wood was carried over is never edited');
END;
CREATE TRIGGER carried_wood_is_kept BEFORE DELETE ON carried
BEGIN
  SELECT RAISE(ABORT, 'from where wood was carried over is never removed');
END;
CREATE TRIGGER carried_wood_is_the_parents BEFORE INSERT ON carried
WHEN NOT EXISTS (
  SELECT 1 FROM allocations AS a
  JOIN parts AS t ON t.panel = a.panel
  JOIN panels AS p ON p.id = a.panel
  JOIN allocations AS o ON o.id = NEW.origin AND o.panel = p.parent AND o.state = a.state
  WHERE a.id = NEW.allocation AND a.piece IS NULL)
 AND NOT EXISTS (
  SELECT 1 FROM allocations AS a
  JOIN allocations AS o ON o.id = NEW.origin AND o.state = a.state
  JOIN merges AS m ON m.kept = a.panel AND m.merged = o.panel
  WHERE a.id = NEW.allocation AND a.piece IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'wood is carried over from a part''s parent, or from a panel that was merged');
END;

-- What was left of a panel after a run, a scan, or whatever else changed its wood. The newest row of a panel tells what
-- is left now while `counted_of` names its wood as it is: mask, what is booked, what its zones are of.
CREATE TABLE remnants (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  panel        TEXT    NOT NULL,
  mask_version INTEGER NOT NULL,
  run          INTEGER REFERENCES runs (id),  -- that was the panel's last one
  counted_of   TEXT    NOT NULL CHECK (counted_of <> ''),
  woods        TEXT    NOT NULL CHECK (json_type(woods) = 'object'),  -- of each material, in square micrometres
  square_um    TEXT    NOT NULL CHECK (json_array_length(square_um) IN (0, 3)),  -- [x, y, side], or of no free wood []
  circle_um    TEXT    NOT NULL CHECK (json_array_length(circle_um) IN (0, 3)),  -- [x, y, radius]
  fitting      TEXT    NOT NULL CHECK (json_type(fitting) = 'object'),  -- of what searches ask for, in um2
  picture_file TEXT    NOT NULL,  -- '' where none could be drawn
  at           TEXT    NOT NULL,
  checksum     INTEGER NOT NULL
               GENERATED ALWAYS AS (veneer_checksum('remnants', id, panel, mask_version, run, counted_of, woods,
                                                    square_um, circle_um, fitting, picture_file, at)) STORED,
  FOREIGN KEY (panel, mask_version) REFERENCES masks (panel, version)
) STRICT;
CREATE INDEX remnants_of ON remnants (panel);

CREATE TRIGGER remnants_are_of_the_panels_runs BEFORE INSERT ON remnants
WHEN NEW.run IS NOT NULL AND NOT EXISTS (SELECT 1 FROM runs WHERE id = NEW.run AND panel = NEW.panel AND ended_at IS NOT
  NULL)
BEGIN
  SELECT RAISE(ABORT, 'a remnant is booked after a run of its panel');
END;
CREATE TRIGGER remnants_are_never_edited BEFORE UPDATE ON remnants
BEGIN
  SELECT RAISE(ABORT, 'what was left of a panel is never edited');
END;
CREATE TRIGGER remnants_are_kept BEFORE DELETE ON remnants
BEGIN
  SELECT RAISE(ABORT, 'what was left of a panel is never removed');
END;

-- The cuts of the last run, as the laser burnt them, so that pieces which are not through can be cut again while their
-- panel lies as it did. Nothing that counts: they are forgotten with the next run.
CREATE TABLE kept_cuts (
  piece    INTEGER PRIMARY KEY REFERENCES pieces (id),
  run      INTEGER NOT NULL REFERENCES runs (id),
  laser    TEXT    NOT NULL,  -- that burnt them, as it tells of itself
  strokes  TEXT    NOT NULL CHECK (json_type(strokes) = 'array'),
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('kept_cuts', piece, run, laser, strokes)) STORED
) STRICT;
CREATE TRIGGER kept_cuts_are_of_the_last_run BEFORE INSERT ON kept_cuts
WHEN NEW.run <> (SELECT max(id) FROM runs)
BEGIN
  SELECT RAISE(ABORT, 'only cuts of the last run are kept');
END;
CREATE TRIGGER kept_cuts_are_never_edited BEFORE UPDATE ON kept_cuts
BEGIN
  SELECT RAISE(ABORT, 'how a piece was cut is never edited');
END;
CREATE TRIGGER kept_cuts_are_forgotten_with_the_next_run AFTER INSERT ON runs
BEGIN
  DELETE FROM kept_cuts;
END;
