-- Schema 19: panels that were sawn apart. Each part is a panel of its own; the wood that was gone from it before is
-- booked there too.

-- With which retirement a panel was sawn apart. While that is its newest, sheets with its tags are parts of it.
CREATE TABLE splits (
  retirement INTEGER PRIMARY KEY REFERENCES retirements (id),
  who        TEXT NOT NULL CHECK (who <> ''),
  checksum   INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('splits', retirement, who)) STORED
) STRICT;

-- part_from_parent: p -> R(angle) p + shift, as measured on so many tags and holes of the parent.
CREATE TABLE parts (
  panel      TEXT    NOT NULL PRIMARY KEY REFERENCES panels (id),
  angle_rad  REAL    NOT NULL,
  shift_x_mm REAL    NOT NULL,
  shift_y_mm REAL    NOT NULL,
  improper   INTEGER NOT NULL CHECK (improper = 0),
  fiducials  INTEGER NOT NULL CHECK (fiducials >= 2),
  rms_mm     REAL    NOT NULL CHECK (rms_mm >= 0),
  checksum   INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('parts', panel, angle_rad, shift_x_mm, shift_y_mm,
    improper, fiducials, rms_mm)) STORED
) STRICT;

-- Wood of a part that was booked when it was the parent's.
CREATE TABLE carried (
  allocation INTEGER PRIMARY KEY REFERENCES allocations (id),
  origin     INTEGER NOT NULL REFERENCES allocations (id),
  outline_um TEXT    NOT NULL,  -- of the piece; no point of wood that was written off
  checksum   INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('carried', allocation, origin, outline_um)) STORED
) STRICT;
CREATE INDEX carried_of ON carried (origin);

CREATE TRIGGER splits_are_retirements BEFORE INSERT ON splits
WHEN NOT EXISTS (SELECT 1 FROM retirements WHERE id = NEW.retirement AND retired = 1)
BEGIN
  SELECT RAISE(ABORT, 'a panel that was sawn apart is retired');
END;
CREATE TRIGGER parts_are_of_sawn_panels BEFORE INSERT ON parts
WHEN NOT EXISTS (
  SELECT 1 FROM panels AS p
  JOIN splits AS s ON s.retirement = (SELECT max(id) FROM retirements WHERE panel = p.parent)
  WHERE p.id = NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'a part is of a panel that was sawn apart');
END;
CREATE TRIGGER sawn_panels_stay_out BEFORE INSERT ON retirements
WHEN NEW.retired = 0
 AND EXISTS (SELECT 1 FROM parts AS t JOIN panels AS p ON p.id = t.panel WHERE p.parent = NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'the parts of this panel are panels of their own');
END;
CREATE TRIGGER carried_wood_is_the_parents BEFORE INSERT ON carried
WHEN NOT EXISTS (
  SELECT 1 FROM allocations AS a
  JOIN parts AS t ON t.panel = a.panel
  JOIN panels AS p ON p.id = a.panel
  JOIN allocations AS o ON o.id = NEW.origin AND o.panel = p.parent AND o.state = a.state
  WHERE a.id = NEW.allocation AND a.piece IS NULL)
BEGIN
  SELECT RAISE(ABORT, 'wood is carried over from a part''s parent');
END;
CREATE TRIGGER carried_wood_stays BEFORE UPDATE OF state ON allocations
WHEN EXISTS (SELECT 1 FROM carried WHERE allocation = OLD.id)
BEGIN
  SELECT RAISE(ABORT, 'this wood was gone before its panel was sawn off');
END;

-- What was cut from a part before it was one is cut wood without a piece.
DROP TRIGGER allocations_begin_reserved;
CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.lease IS NOT NULL THEN 'leased' WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
 AND NOT (NEW.state = 'cut' AND NEW.piece IS NULL AND NEW.lease IS NULL
          AND EXISTS (SELECT 1 FROM parts WHERE panel = NEW.panel))
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, leased, or written off as scrap');
END;

CREATE TRIGGER splits_are_never_edited BEFORE UPDATE ON splits
BEGIN
  SELECT RAISE(ABORT, 'that a panel was sawn apart is never edited');
END;
CREATE TRIGGER splits_are_kept BEFORE DELETE ON splits
BEGIN
  SELECT RAISE(ABORT, 'that a panel was sawn apart is never removed');
END;
CREATE TRIGGER parts_are_never_edited BEFORE UPDATE ON parts
BEGIN
  SELECT RAISE(ABORT, 'where a part lay in its parent is never edited');
END;
CREATE TRIGGER parts_are_kept BEFORE DELETE ON parts
BEGIN
  SELECT RAISE(ABORT, 'where a part lay in its parent is never removed');
END;
CREATE TRIGGER carried_wood_is_never_edited BEFORE UPDATE ON carried
BEGIN
  SELECT RAISE(ABORT, 'from where wood was carried over is never edited');
END;
CREATE TRIGGER carried_wood_is_kept BEFORE DELETE ON carried
BEGIN
  SELECT RAISE(ABORT, 'from where wood was carried over is never removed');
END;
