-- Schema 2: which wood a panel's zones are of, and how each wood is burnt.

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
  CHECK ((kerf_back_um IS NULL) = (kerf_show_um IS NULL)),
  CHECK (operation = 'cut' OR kerf_back_um IS NULL),
  PRIMARY KEY (material, operation)
) STRICT, WITHOUT ROWID;

-- Strips of wood, as the panel's first scan showed them; a person says of which wood they are.
CREATE TABLE zones (
  panel      TEXT    NOT NULL REFERENCES panels (id),
  number     INTEGER NOT NULL CHECK (number > 0),
  outline_um TEXT    NOT NULL,
  material   TEXT    NOT NULL DEFAULT '',  -- '': nobody has said
  PRIMARY KEY (panel, number)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER zones_keep_their_wood BEFORE UPDATE OF panel, number, outline_um ON zones
BEGIN
  SELECT RAISE(ABORT, 'the outline of a zone never changes');
END;
