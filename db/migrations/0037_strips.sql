-- Schema 37: how sure the eye was of each zone, what people drew of zones since, and of which strips a scan that waits
-- asks somebody. Zones are areas since: `outline_um` of those that were found before is a ring around the strip.

-- From 0 to 1: that the strip is veneer, whole, and ends where its sides were seen. Zones from before have no row.
CREATE TABLE zone_confidences (
  panel      TEXT    NOT NULL,
  number     INTEGER NOT NULL,
  confidence REAL    NOT NULL CHECK (confidence BETWEEN 0 AND 1),
  checksum   INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('zone_confidences', panel, number, confidence)) STORED,
  PRIMARY KEY (panel, number),
  FOREIGN KEY (panel, number) REFERENCES zones (panel, number)
) STRICT, WITHOUT ROWID;

-- What zones are since somebody drew one of them anew. Of each zone the highest version counts; 1 is what `zones` has.
CREATE TABLE zone_versions (
  panel      TEXT    NOT NULL,
  number     INTEGER NOT NULL,
  version    INTEGER NOT NULL CHECK (version > 1),
  outline_um TEXT    NOT NULL,  -- an area
  who        TEXT    NOT NULL CHECK (who <> ''),
  at         TEXT    NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('zone_versions', panel, number, version, outline_um, who, at)) STORED,
  PRIMARY KEY (panel, number, version),
  FOREIGN KEY (panel, number) REFERENCES zones (panel, number)
) STRICT, WITHOUT ROWID;

-- `number` is that of its warning, 1 of strip-1.
CREATE TABLE asked_strips (
  proposal   INTEGER NOT NULL REFERENCES proposals (id),
  number     INTEGER NOT NULL CHECK (number > 0),
  outline_um TEXT    NOT NULL,                          -- a ring
  confidence REAL    NOT NULL CHECK (confidence BETWEEN 0 AND 1),
  taken      INTEGER NOT NULL CHECK (taken IN (0, 1)),  -- 1: usable unless somebody says otherwise
  reason     TEXT    NOT NULL CHECK (reason <> ''),
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('asked_strips', proposal, number, outline_um, confidence, taken,
               reason)) STORED,
  PRIMARY KEY (proposal, number)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER zone_confidences_are_never_edited BEFORE UPDATE ON zone_confidences
BEGIN
  SELECT RAISE(ABORT, 'how sure a scan was of a zone is never edited');
END;
CREATE TRIGGER zone_confidences_are_kept BEFORE DELETE ON zone_confidences
BEGIN
  SELECT RAISE(ABORT, 'how sure a scan was of a zone is never removed');
END;
CREATE TRIGGER zone_versions_are_never_edited BEFORE UPDATE ON zone_versions
BEGIN
  SELECT RAISE(ABORT, 'what was drawn of a zone is never edited');
END;
CREATE TRIGGER zone_versions_are_kept BEFORE DELETE ON zone_versions
BEGIN
  SELECT RAISE(ABORT, 'what was drawn of a zone is never removed');
END;
CREATE TRIGGER asked_strips_are_never_edited BEFORE UPDATE ON asked_strips
BEGIN
  SELECT RAISE(ABORT, 'what a scan asked about is never edited');
END;
CREATE TRIGGER asked_strips_are_kept BEFORE DELETE ON asked_strips
BEGIN
  SELECT RAISE(ABORT, 'what a scan asked about is never removed');
END;
