-- Schema 8: how much wood a mask calls usable, counted once when the mask was made. Masks of older schemas have no row.

CREATE TABLE mask_areas (
  panel      TEXT    NOT NULL,
  version    INTEGER NOT NULL,
  usable_um2 INTEGER NOT NULL CHECK (usable_um2 >= 0),
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('mask_areas', panel, version, usable_um2)) STORED,
  PRIMARY KEY (panel, version),
  FOREIGN KEY (panel, version) REFERENCES masks (panel, version)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER mask_areas_are_never_edited BEFORE UPDATE ON mask_areas
BEGIN
  SELECT RAISE(ABORT, 'the area of a mask is never edited');
END;
CREATE TRIGGER mask_areas_are_kept BEFORE DELETE ON mask_areas
BEGIN
  SELECT RAISE(ABORT, 'the area of a mask is never removed');
END;
