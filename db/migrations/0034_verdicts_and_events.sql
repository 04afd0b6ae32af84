-- Schema 34: what people said of suspect pieces, as rows, and names under which others look for what is stored: the
-- pictures that plans are made of, the registration of each scan, and what happened, in one list.

-- What a person said of a piece, and by which step its wood got that state. `suspect`: he takes back that it is lost.
-- What was said before this schema is in the audit log alone.
CREATE TABLE verdicts (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  allocation INTEGER NOT NULL REFERENCES allocations (id),
  step       INTEGER NOT NULL UNIQUE REFERENCES allocation_history (id),
  verdict    TEXT    NOT NULL CHECK (verdict IN ('cut', 'scrap', 'released', 'suspect')),
  as_seen    INTEGER NOT NULL CHECK (as_seen IN (0, 1)),  -- 1: he took over what a scan saw
  who        TEXT    NOT NULL,
  at         TEXT    NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('verdicts', id, allocation, step, verdict, as_seen, who, at)) STORED
) STRICT;
CREATE INDEX verdicts_of ON verdicts (allocation);

-- It is said in the transaction that moves the wood: its step is the newest, and the one before is what it was said of.
CREATE TRIGGER a_verdict_is_what_its_wood_became BEFORE INSERT ON verdicts
WHEN NOT EXISTS (SELECT 1 FROM allocations WHERE id = NEW.allocation AND piece IS NOT NULL AND state = NEW.verdict)
 OR NOT EXISTS (SELECT 1 FROM allocation_history
                WHERE id = NEW.step AND allocation = NEW.allocation AND state = NEW.verdict)
 OR EXISTS (SELECT 1 FROM allocation_history WHERE allocation = NEW.allocation AND id > NEW.step)
 OR (SELECT state FROM allocation_history WHERE allocation = NEW.allocation AND id < NEW.step ORDER BY id DESC LIMIT 1)
    IS NOT CASE NEW.verdict WHEN 'suspect' THEN 'scrap' ELSE 'suspect' END
BEGIN
  SELECT RAISE(ABORT, 'a verdict is of a piece whose wood just became that by it');
END;
CREATE TRIGGER verdicts_are_never_edited BEFORE UPDATE ON verdicts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a piece is never edited');
END;
CREATE TRIGGER verdicts_are_kept BEFORE DELETE ON verdicts
BEGIN
  SELECT RAISE(ABORT, 'what was said of a piece is never removed');
END;

-- A picture in one size and crop, of which any number of plans was made.
CREATE VIEW artworks AS
SELECT picture, size_mm, crop, min(plan) AS first_plan, max(plan) AS newest_plan, count(*) AS plans, min(at) AS at
FROM (SELECT id AS plan, target_file AS picture, created_at AS at,
             CASE WHEN json_valid(options_json) THEN json_extract(options_json, '$.size_mm') END AS size_mm,
             CASE WHEN json_valid(options_json) THEN json_extract(options_json, '$.crop') END AS crop
      FROM plans WHERE target_file <> '')
GROUP BY picture, size_mm, crop;

CREATE VIEW registrations AS
SELECT id AS scan, panel, face, rms_mm, max_mm, lattice, taken_at FROM scans;

-- What happened to wood, pieces, runs, jobs, panels and the cell; none of leases, proposals, mask edits, merges and
-- splits. `step` orders the rows of one kind within an instant, and verdicts among those of wood: a settled piece stands
-- once, as a verdict.
CREATE VIEW events AS
SELECT h.at AS at, h.id AS step, 'wood' AS kind, a.panel AS panel, a.job AS job, a.piece AS piece, h.run AS run, h.state AS what,
       '' AS who
FROM allocation_history AS h JOIN allocations AS a ON a.id = h.allocation
WHERE NOT EXISTS (SELECT 1 FROM verdicts WHERE step = h.id)
UNION ALL
SELECT v.at, v.step, 'verdict', a.panel, a.job, a.piece, NULL, v.verdict, v.who
FROM verdicts AS v JOIN allocations AS a ON a.id = v.allocation
UNION ALL
SELECT s.at, s.id, 'assembly', a.panel, a.job, a.piece, NULL, CASE s.assembled WHEN 1 THEN 'laid' ELSE 'taken back' END, s.who
FROM assemblies AS s JOIN allocations AS a ON a.id = s.allocation
UNION ALL
SELECT r.started_at, r.id, 'run', r.panel, r.job, NULL, r.id, 'started', coalesce(f.who, '')
FROM runs AS r LEFT JOIN run_facts AS f ON f.run = r.id
UNION ALL
SELECT ended_at, id, 'run', panel, job, NULL, id, result, '' FROM runs WHERE ended_at IS NOT NULL
UNION ALL
SELECT created_at, id, 'job', NULL, id, NULL, NULL, 'made', '' FROM jobs
UNION ALL
SELECT at, id, 'job', NULL, job, NULL, NULL, 'pieces made again', '' FROM redos
UNION ALL
SELECT at, id, 'job', NULL, job, NULL, NULL, CASE archived WHEN 1 THEN 'archived' ELSE 'in sight again' END, ''
FROM archivings
UNION ALL
SELECT created_at, number, 'panel', id, NULL, NULL, NULL, 'entered', '' FROM panels
UNION ALL
SELECT at, id, 'panel', panel, NULL, NULL, NULL, CASE retired WHEN 1 THEN 'retired' ELSE 'restored' END, '' FROM retirements
UNION ALL
SELECT taken_at, id, 'scan', panel, NULL, NULL, NULL, face, '' FROM scans
UNION ALL
SELECT made_at, version, 'mask', panel, NULL, NULL, NULL, 'version ' || version, '' FROM masks
UNION ALL
SELECT at, id, 'treatment', panel, NULL, NULL, NULL, kind, who FROM treatments
UNION ALL
SELECT found_at, id, 'difference', panel, NULL, NULL, NULL, kind, '' FROM differences
UNION ALL
SELECT v.at, v.id, 'difference', d.panel, NULL, NULL, NULL, v.verdict, v.who
FROM difference_verdicts AS v JOIN differences AS d ON d.id = v.difference
UNION ALL
SELECT at, id, 'cell', NULL, NULL, NULL, NULL, CASE under_way WHEN 1 THEN doing ELSE 'at rest' END, '' FROM activities
UNION ALL
SELECT at, id, 'cell', NULL, NULL, NULL, NULL, CASE cleared WHEN 1 THEN 'cleared' ELSE reason END, who FROM aborts;
