-- Schema 15: what people know of a wood and of a panel. A row for each change; the newest counts, null: nobody has said.

CREATE TABLE material_facts (
  id             INTEGER PRIMARY KEY AUTOINCREMENT,
  material       TEXT NOT NULL CHECK (material <> ''),
  botanical_name TEXT CHECK (botanical_name <> ''),
  origin         TEXT CHECK (origin <> ''),
  cites          TEXT CHECK (cites IN ('not_listed', 'I', 'II', 'III')),  -- the appendix it is in
  supplier       TEXT CHECK (supplier <> ''),
  who            TEXT NOT NULL,
  at             TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('material_facts', id, material, botanical_name, origin,
    cites, supplier, who, at)) STORED
) STRICT;
CREATE INDEX material_facts_of ON material_facts (material);

CREATE TABLE panel_facts (
  id           INTEGER PRIMARY KEY AUTOINCREMENT,
  panel        TEXT NOT NULL REFERENCES panels (id),
  shelf        TEXT CHECK (shelf <> ''),
  veneer_um    INTEGER CHECK (veneer_um > 0),
  substrate_um INTEGER CHECK (substrate_um > 0),
  who          TEXT NOT NULL,
  at           TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('panel_facts', id, panel, shelf, veneer_um,
    substrate_um, who, at)) STORED
) STRICT;
CREATE INDEX panel_facts_of ON panel_facts (panel);

-- What was done to the surface of a panel's show face: it looks different from then on. treated_at is a day, or a time.
CREATE TABLE treatments (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  panel      TEXT NOT NULL REFERENCES panels (id),
  kind       TEXT NOT NULL CHECK (kind IN ('sanding', 'finish')),
  product    TEXT NOT NULL CHECK (product <> ''),
  treated_at TEXT NOT NULL CHECK (length(treated_at) IN (10, 24)),
  who        TEXT NOT NULL,
  at         TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('treatments', id, panel, kind, product, treated_at,
    who, at)) STORED
) STRICT;
CREATE INDEX treatments_of ON treatments (panel);

CREATE TRIGGER material_facts_are_never_edited BEFORE UPDATE ON material_facts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a wood is never edited');
END;
CREATE TRIGGER material_facts_are_kept BEFORE DELETE ON material_facts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a wood is never removed');
END;
CREATE TRIGGER panel_facts_are_never_edited BEFORE UPDATE ON panel_facts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a panel is never edited');
END;
CREATE TRIGGER panel_facts_are_kept BEFORE DELETE ON panel_facts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a panel is never removed');
END;
CREATE TRIGGER treatments_are_never_edited BEFORE UPDATE ON treatments
BEGIN
  SELECT RAISE(ABORT, 'what was done to a panel is never edited');
END;
CREATE TRIGGER treatments_are_kept BEFORE DELETE ON treatments
BEGIN
  SELECT RAISE(ABORT, 'what was done to a panel is never removed');
END;
