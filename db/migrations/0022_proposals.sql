-- Schema 22: what a scan saw is a proposal until somebody accepts it; masks that people painted on; records of panels
-- that turned out to be one sheet.

-- A first scan of a sheet (`panel` is null), or one that would change much of the wood of a known panel. Its pictures
-- and what was read from them are files, until it is decided.
CREATE TABLE proposals (
  id          INTEGER PRIMARY KEY AUTOINCREMENT,
  panel       TEXT REFERENCES panels (id),
  after       INTEGER CHECK (after > 0),  -- the version of its mask that the scan was compared with
  who         TEXT    NOT NULL CHECK (who <> ''),
  made_at     TEXT    NOT NULL,
  map_file    TEXT    NOT NULL CHECK (map_file <> ''),
  mask_file   TEXT    NOT NULL CHECK (mask_file <> ''),
  read_file   TEXT    NOT NULL CHECK (read_file <> ''),
  read_sha256 TEXT    NOT NULL CHECK (length(read_sha256) = 64),
  scan_files  TEXT    NOT NULL CHECK (json_type(scan_files) = 'array'),
  tags        TEXT    NOT NULL CHECK (json_type(tags) = 'array'),  -- of the show face
  width_um    INTEGER NOT NULL CHECK (width_um > 0),
  height_um   INTEGER NOT NULL CHECK (height_um > 0),
  usable_um2  INTEGER NOT NULL CHECK (usable_um2 >= 0),
  lost_um2    INTEGER NOT NULL CHECK (lost_um2 >= 0),      -- free wood that it would take, not beside what was cut
  gained_um2  INTEGER NOT NULL CHECK (gained_um2 >= 0),    -- and would give back
  warnings    TEXT    NOT NULL CHECK (json_type(warnings) = 'array'),
  checksum    INTEGER NOT NULL
              GENERATED ALWAYS AS (veneer_checksum('proposals', id, panel, after, who, made_at, map_file, mask_file,
                read_file, read_sha256, scan_files, tags, width_um, height_um, usable_um2, lost_um2, gained_um2,
                warnings)) STORED,
  CHECK ((panel IS NULL) = (after IS NULL))
) STRICT;
CREATE INDEX proposals_of_panel ON proposals (panel);

-- One without a row here is open.
CREATE TABLE proposal_verdicts (
  proposal     INTEGER PRIMARY KEY REFERENCES proposals (id),
  verdict      TEXT NOT NULL CHECK (verdict IN ('accepted', 'refused', 'replaced')),
  overruled    TEXT NOT NULL CHECK (json_type(overruled) = 'array'),  -- names of warnings
  panel        TEXT REFERENCES panels (id),         -- what it became, or whose mask
  mask_version INTEGER CHECK (mask_version > 0),
  who          TEXT NOT NULL CHECK (who <> ''),
  note         TEXT NOT NULL,
  at           TEXT NOT NULL,
  checksum     INTEGER NOT NULL
               GENERATED ALWAYS AS (veneer_checksum('proposal_verdicts', proposal, verdict, overruled, panel,
                 mask_version, who, note, at)) STORED,
  CHECK ((verdict = 'accepted') = (panel IS NOT NULL)),
  CHECK ((panel IS NULL) = (mask_version IS NULL))
) STRICT;

-- Wood that somebody gave back to a panel's mask, or withheld; of those that meet the later one counts. It holds for
-- every later scan, too.
CREATE TABLE mask_edits (
  id       INTEGER PRIMARY KEY AUTOINCREMENT,
  panel    TEXT NOT NULL REFERENCES panels (id),
  kind     TEXT NOT NULL CHECK (kind IN ('give', 'withhold')),
  shape_um TEXT NOT NULL CHECK (shape_um <> ''),  -- an area
  who      TEXT NOT NULL CHECK (who <> ''),
  note     TEXT NOT NULL,
  at       TEXT NOT NULL,
  checksum INTEGER NOT NULL
           GENERATED ALWAYS AS (veneer_checksum('mask_edits', id, panel, kind, shape_um, who, note, at)) STORED
) STRICT;
CREATE INDEX mask_edits_of_panel ON mask_edits (panel);

CREATE TABLE mask_edit_removals (
  edit     INTEGER PRIMARY KEY REFERENCES mask_edits (id),
  who      TEXT NOT NULL CHECK (who <> ''),
  at       TEXT NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('mask_edit_removals', edit, who, at)) STORED
) STRICT;

-- Of a version of a mask that was painted on: what the scan alone saw. One without a row is as its scan saw it.
CREATE TABLE painted_masks (
  panel     TEXT    NOT NULL,
  version   INTEGER NOT NULL,
  seen_file TEXT    NOT NULL CHECK (seen_file <> ''),
  checksum  INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('painted_masks', panel, version, seen_file)) STORED,
  PRIMARY KEY (panel, version),
  FOREIGN KEY (panel, version) REFERENCES masks (panel, version)
) STRICT, WITHOUT ROWID;

-- `merged` is the sheet that `kept` is; kept_from_merged: p -> R(angle) F p + shift, mirrored where the back of the
-- sheet had been scanned as its show face.
CREATE TABLE merges (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  kept       TEXT    NOT NULL REFERENCES panels (id),
  merged     TEXT    NOT NULL UNIQUE REFERENCES panels (id),
  angle_rad  REAL    NOT NULL,
  shift_x_mm REAL    NOT NULL,
  shift_y_mm REAL    NOT NULL,
  improper   INTEGER NOT NULL CHECK (improper IN (0, 1)),
  fiducials  INTEGER NOT NULL CHECK (fiducials >= 2),
  rms_mm     REAL    NOT NULL CHECK (rms_mm >= 0),
  -- The newest scan then: nothing is planned on `kept` until a later one shows its face. 0: there is no need.
  last_scan  INTEGER NOT NULL CHECK (last_scan >= 0),
  who        TEXT    NOT NULL CHECK (who <> ''),
  at         TEXT    NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('merges', id, kept, merged, angle_rad, shift_x_mm, shift_y_mm,
               improper, fiducials, rms_mm, last_scan, who, at)) STORED,
  CHECK (kept <> merged)
) STRICT;
CREATE INDEX merges_into ON merges (kept);

CREATE TRIGGER proposals_stay_with_their_panel BEFORE INSERT ON proposal_verdicts
WHEN NEW.verdict = 'accepted' AND EXISTS (SELECT 1 FROM proposals
                                          WHERE id = NEW.proposal AND panel IS NOT NULL AND panel <> NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'a scan is of the panel that it was compared with');
END;
CREATE TRIGGER merged_panels_are_out_of_stock BEFORE INSERT ON merges
WHEN coalesce((SELECT retired FROM retirements WHERE panel = NEW.merged ORDER BY id DESC LIMIT 1), 0) = 0
BEGIN
  SELECT RAISE(ABORT, 'a panel that was merged is retired');
END;
CREATE TRIGGER merged_panels_stay_out BEFORE INSERT ON retirements
WHEN NEW.retired = 0 AND EXISTS (SELECT 1 FROM merges WHERE merged = NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'this panel is another one, which holds its wood');
END;

-- Wood is carried over from a part's parent, and from a panel that was merged.
DROP TRIGGER carried_wood_is_the_parents;
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
DROP TRIGGER allocations_begin_reserved;
CREATE TRIGGER allocations_begin_reserved BEFORE INSERT ON allocations
WHEN NEW.state <> CASE WHEN NEW.lease IS NOT NULL THEN 'leased' WHEN NEW.piece IS NULL THEN 'scrap' ELSE 'reserved' END
 AND NOT (NEW.state = 'cut' AND NEW.piece IS NULL AND NEW.lease IS NULL
          AND (EXISTS (SELECT 1 FROM parts WHERE panel = NEW.panel)
               OR EXISTS (SELECT 1 FROM merges WHERE kept = NEW.panel)))
BEGIN
  SELECT RAISE(ABORT, 'wood is reserved for a piece, leased, or written off as scrap');
END;

CREATE TRIGGER proposals_are_never_edited BEFORE UPDATE ON proposals
BEGIN
  SELECT RAISE(ABORT, 'what a scan proposed is never edited');
END;
CREATE TRIGGER proposals_are_kept BEFORE DELETE ON proposals
BEGIN
  SELECT RAISE(ABORT, 'what a scan proposed is never removed');
END;
CREATE TRIGGER proposal_verdicts_are_never_edited BEFORE UPDATE ON proposal_verdicts
BEGIN
  SELECT RAISE(ABORT, 'what became of a proposal is never edited');
END;
CREATE TRIGGER proposal_verdicts_are_kept BEFORE DELETE ON proposal_verdicts
BEGIN
  SELECT RAISE(ABORT, 'what became of a proposal is never removed');
END;
CREATE TRIGGER mask_edits_are_never_edited BEFORE UPDATE ON mask_edits
BEGIN
  SELECT RAISE(ABORT, 'what was painted on a mask is never edited');
END;
CREATE TRIGGER mask_edits_are_kept BEFORE DELETE ON mask_edits
BEGIN
  SELECT RAISE(ABORT, 'what was painted on a mask is taken back, never removed');
END;
CREATE TRIGGER mask_edit_removals_are_never_edited BEFORE UPDATE ON mask_edit_removals
BEGIN
  SELECT RAISE(ABORT, 'that an edit of a mask was taken back is never edited');
END;
CREATE TRIGGER mask_edit_removals_are_kept BEFORE DELETE ON mask_edit_removals
BEGIN
  SELECT RAISE(ABORT, 'that an edit of a mask was taken back is never removed');
END;
CREATE TRIGGER painted_masks_are_never_edited BEFORE UPDATE ON painted_masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never edited');
END;
CREATE TRIGGER painted_masks_are_kept BEFORE DELETE ON painted_masks
BEGIN
  SELECT RAISE(ABORT, 'a version of a mask is never edited');
END;
CREATE TRIGGER merges_are_never_edited BEFORE UPDATE ON merges
BEGIN
  SELECT RAISE(ABORT, 'that panels were merged is never edited');
END;
CREATE TRIGGER merges_are_kept BEFORE DELETE ON merges
BEGIN
  SELECT RAISE(ABORT, 'that panels were merged is never removed');
END;
