-- Schema 17: the wood of a plan that is kept can be leased: nobody else gets it until a time.

CREATE TABLE leases (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  plan     INTEGER NOT NULL,  -- its number alone: what was leased is known when the plan is gone
  who      TEXT    NOT NULL CHECK (who <> ''),
  at       TEXT    NOT NULL,  -- when it was made, or renewed last
  until    TEXT    NOT NULL,
  ended    TEXT    CHECK (ended IN ('expired', 'released', 'taken', 'spoilt')),
  ended_at TEXT,
  checksum INTEGER NOT NULL
           GENERATED ALWAYS AS (veneer_checksum('leases', id, plan, who, at, until, ended, ended_at)) STORED,
  CHECK (until > at),
  CHECK ((ended IS NULL) = (ended_at IS NULL))
) STRICT;
CREATE UNIQUE INDEX one_lease_of_a_plan ON leases (plan) WHERE ended IS NULL;

-- The ledger anew: wood of a panel that is held for a piece or under a lease, or written off. The index of wood stays
-- as it is, because no number changes.
CREATE TEMP TABLE old_allocations AS SELECT * FROM main.allocations;
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
  area_um    TEXT    NOT NULL,
  reason     TEXT    NOT NULL,  -- of wood written off
  changed_at TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('allocations', id, panel, job, piece, placement,
    lease, state, area_um, reason, changed_at)) STORED,
  CHECK ((job IS NULL) = (piece IS NULL) AND (job IS NULL) = (placement IS NULL)),
  CHECK (job IS NULL OR lease IS NULL),
  CHECK (CASE WHEN lease IS NULL THEN state <> 'leased' ELSE state IN ('leased', 'released') END),
  FOREIGN KEY (piece, job) REFERENCES pieces (id, job)
) STRICT;
CREATE INDEX allocations_of_panel ON allocations (panel);
CREATE INDEX allocations_of_job ON allocations (job, piece);
CREATE INDEX allocations_of_lease ON allocations (lease) WHERE lease IS NOT NULL;
CREATE UNIQUE INDEX one_piece_of_wood_per_piece ON allocations (piece) WHERE state NOT IN ('released', 'scrap');

INSERT INTO allocations (id, panel, job, piece, placement, state, area_um, reason, changed_at)
SELECT id, panel, job, piece, placement, state, area_um, reason, changed_at FROM temp.old_allocations ORDER BY id;
DROP TABLE temp.old_allocations;

DROP TRIGGER allocation_moves_are_complete;
INSERT INTO allocation_moves (from_state, to_state) VALUES ('leased', 'released');
CREATE TRIGGER allocation_moves_are_complete BEFORE INSERT ON allocation_moves
BEGIN
  SELECT RAISE(ABORT, 'the moves of wood are fixed');
END;

CREATE TRIGGER allocations_are_sound BEFORE UPDATE ON allocations
WHEN OLD.checksum <> veneer_checksum('allocations', OLD.id, OLD.panel, OLD.job, OLD.piece, OLD.placement, OLD.lease,
  OLD.state, OLD.area_um, OLD.reason, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER allocations_keep_their_wood BEFORE UPDATE OF id, panel, job, piece, placement, lease, area_um, reason ON
  allocations
BEGIN
  SELECT RAISE(ABORT, 'the wood of an allocation never changes');
END;
CREATE TRIGGER allocations_are_kept BEFORE DELETE ON allocations
BEGIN
  SELECT RAISE(ABORT, 'wood is released, never forgotten');
END;
CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.lease IS NOT NULL THEN 'leased' WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, leased, or written off as scrap');
END;
CREATE TRIGGER allocations_are_where_the_piece_is_placed BEFORE INSERT ON allocations
WHEN NEW.piece IS NOT NULL AND NOT EXISTS (
  SELECT 1 FROM placements AS l JOIN pieces AS p ON p.patch = l.patch
  WHERE l.id = NEW.placement AND p.id = NEW.piece AND l.panel = NEW.panel AND l.area_um = NEW.area_um)
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved where its piece is placed');
END;
CREATE TRIGGER wood_is_leased_under_a_lease BEFORE INSERT ON allocations
WHEN NEW.lease IS NOT NULL AND NOT EXISTS (SELECT 1 FROM leases WHERE id = NEW.lease AND ended IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'wood is leased under a lease that lasts');
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

CREATE TRIGGER leases_are_sound BEFORE UPDATE ON leases
WHEN OLD.checksum <> veneer_checksum('leases', OLD.id, OLD.plan, OLD.who, OLD.at, OLD.until, OLD.ended, OLD.ended_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER leases_are_of_a_plan BEFORE INSERT ON leases
WHEN NEW.ended IS NOT NULL OR NOT EXISTS (SELECT 1 FROM plans WHERE id = NEW.plan)
BEGIN
  SELECT RAISE(ABORT, 'a lease begins with a plan that is there');
END;
CREATE TRIGGER leases_keep_their_plan BEFORE UPDATE OF id, plan ON leases
BEGIN
  SELECT RAISE(ABORT, 'a lease is of one plan');
END;
CREATE TRIGGER leases_end_once BEFORE UPDATE ON leases WHEN OLD.ended IS NOT NULL
BEGIN
  SELECT RAISE(ABORT, 'a lease that ended is never edited');
END;
CREATE TRIGGER leases_are_kept BEFORE DELETE ON leases
BEGIN
  SELECT RAISE(ABORT, 'a lease is never removed');
END;
CREATE TRIGGER ended_leases_release_their_wood AFTER UPDATE OF ended ON leases WHEN NEW.ended IS NOT NULL
BEGIN
  UPDATE allocations SET state = 'released', changed_at = NEW.ended_at WHERE lease = NEW.id AND state = 'leased';
END;

-- What holds wood stays.
CREATE TRIGGER leased_plans_are_kept BEFORE DELETE ON plans
WHEN EXISTS (SELECT 1 FROM leases WHERE plan = OLD.id AND ended IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'a plan that leases its wood is never removed');
END;
CREATE TRIGGER placements_of_leased_plans_are_kept BEFORE DELETE ON placements
WHEN EXISTS (SELECT 1 FROM leases WHERE plan = OLD.plan AND ended IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'a plan that leases its wood is never removed');
END;
DROP TRIGGER retired_panels_hold_no_open_piece;
CREATE TRIGGER retired_panels_hold_no_open_piece BEFORE INSERT ON retirements
WHEN NEW.retired = 1
 AND EXISTS (SELECT 1 FROM allocations
             WHERE panel = NEW.panel AND state IN ('leased', 'reserved', 'cutting', 'suspect'))
BEGIN
  SELECT RAISE(ABORT, 'a panel with wood that is leased, or with pieces that are not cut yet, stays in stock');
END;
