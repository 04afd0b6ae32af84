-- Schema 40: who made a job.

DROP VIEW events;

-- The same table, with one kind more, "made": who made the job of this number.
CREATE TABLE done_by_before (
  kind     TEXT    NOT NULL,
  number   INTEGER NOT NULL,
  who      TEXT    NOT NULL
) STRICT;
INSERT INTO done_by_before (kind, number, who) SELECT kind, number, who FROM done_by;
DROP TABLE done_by;

-- Who did what a row of another table tells: of jobs (who made them), job_history, archivings, retirements, or of a lease
-- that ended. What has no row here was done before, or nobody noted who did it, or the cell did it by itself.
CREATE TABLE done_by (
  kind     TEXT    NOT NULL CHECK (kind IN ('made', 'job', 'archiving', 'retirement', 'lease')),
  number   INTEGER NOT NULL,
  who      TEXT    NOT NULL CHECK (who <> ''),
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('done_by', kind, number, who)) STORED,
  PRIMARY KEY (kind, number)
) STRICT, WITHOUT ROWID;
INSERT INTO done_by (kind, number, who) SELECT kind, number, who FROM done_by_before;
DROP TABLE done_by_before;

CREATE TRIGGER done_by_is_never_edited BEFORE UPDATE ON done_by
BEGIN
  SELECT RAISE(ABORT, 'who did something is never edited');
END;
CREATE TRIGGER done_by_is_kept BEFORE DELETE ON done_by
BEGIN
  SELECT RAISE(ABORT, 'who did something is never removed');
END;
CREATE TRIGGER done_by_is_of_what_was_done BEFORE INSERT ON done_by
WHEN NOT CASE NEW.kind
  WHEN 'made' THEN EXISTS (SELECT 1 FROM jobs WHERE id = NEW.number)
  WHEN 'job' THEN EXISTS (SELECT 1 FROM job_history WHERE id = NEW.number)
  WHEN 'archiving' THEN EXISTS (SELECT 1 FROM archivings WHERE id = NEW.number)
  WHEN 'retirement' THEN EXISTS (SELECT 1 FROM retirements WHERE id = NEW.number)
  ELSE EXISTS (SELECT 1 FROM leases WHERE id = NEW.number AND ended IS NOT NULL) END
BEGIN
  SELECT RAISE(ABORT, 'nobody did what was not done');
END;

-- What happened to wood, pieces, runs, jobs, panels and the cell. `part` numbers what is told of one kind, `step` orders
-- the rows of one part within an instant: together with the panel, of masks, no two rows have all of these. The casts
-- give each column one type in all parts: without that SQLite gathers and sorts all that happened for each page instead
-- of merging the parts as the page needs them. A settled piece stands once, as a verdict, and a panel that was sawn apart
-- or merged once, and not as a retirement too. Wood that a part, or a panel that others were merged into, holds since it
-- was theirs is told as carried over, and what was done to the surface of a part before it was one is told of its parent
-- alone. Of a lease that was renewed, the last renewal alone is known.
CREATE VIEW events AS
SELECT h.at AS at, h.id AS step, 'wood' AS kind, 0 AS part, a.panel AS panel, a.job AS job, a.piece AS piece,
       h.run AS run,
       CAST(CASE WHEN EXISTS (SELECT 1 FROM carried WHERE allocation = a.id) THEN 'carried over: ' || h.state
                 ELSE h.state END AS TEXT) AS what,
       CAST('' AS TEXT) AS who
FROM allocation_history AS h JOIN allocations AS a ON a.id = h.allocation
WHERE NOT EXISTS (SELECT 1 FROM verdicts WHERE step = h.id)
UNION ALL
SELECT v.at, v.step, 'verdict', 0, a.panel, a.job, a.piece, CAST(NULL AS INTEGER), v.verdict, v.who
FROM verdicts AS v JOIN allocations AS a ON a.id = v.allocation
UNION ALL
SELECT s.at, s.id, 'sighting', 0, a.panel, a.job, a.piece, CAST(NULL AS INTEGER),
       CAST(CASE s.seen WHEN 'cut' THEN 'looks cut' WHEN 'still_there' THEN 'looks still there' ELSE 'unclear' END AS TEXT),
       CAST('' AS TEXT)
FROM sightings AS s JOIN allocations AS a ON a.id = s.allocation
UNION ALL
SELECT s.at, s.id, 'assembly', 0, a.panel, a.job, a.piece, CAST(NULL AS INTEGER),
       CAST(CASE s.assembled WHEN 1 THEN 'laid' ELSE 'taken back' END AS TEXT), s.who
FROM assemblies AS s JOIN allocations AS a ON a.id = s.allocation
UNION ALL
SELECT r.started_at, r.id, 'run', 0, r.panel, r.job, CAST(NULL AS INTEGER), r.id, CAST('started' AS TEXT),
       CAST(coalesce(f.who, '') AS TEXT)
FROM runs AS r LEFT JOIN run_facts AS f ON f.run = r.id
UNION ALL
SELECT ended_at, id, 'run', 1, panel, job, CAST(NULL AS INTEGER), id, result, CAST('' AS TEXT)
FROM runs WHERE ended_at IS NOT NULL
UNION ALL
SELECT j.created_at, j.id, 'job', 0, CAST(NULL AS TEXT), j.id, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('made' AS TEXT), CAST(coalesce(d.who, '') AS TEXT)
FROM jobs AS j LEFT JOIN done_by AS d ON d.kind = 'made' AND d.number = j.id
UNION ALL
SELECT h.at, h.id, 'job', 1, CAST(NULL AS TEXT), h.job, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), h.state,
       CAST(coalesce(d.who, '') AS TEXT)
FROM job_history AS h LEFT JOIN done_by AS d ON d.kind = 'job' AND d.number = h.id
UNION ALL
-- Of the plan only who asked for it.
SELECT r.at, r.id, 'job', 2, CAST(NULL AS TEXT), r.job, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('pieces made again' AS TEXT), p.who
FROM redos AS r, plans AS p WHERE p.id = r.plan
UNION ALL
SELECT a.at, a.id, 'job', 3, CAST(NULL AS TEXT), a.job, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(CASE a.archived WHEN 1 THEN 'archived' ELSE 'in sight again' END AS TEXT),
       CAST(coalesce(d.who, '') AS TEXT)
FROM archivings AS a LEFT JOIN done_by AS d ON d.kind = 'archiving' AND d.number = a.id
UNION ALL
SELECT at, id, 'lease', 0, CAST(NULL AS TEXT), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('lease of plan ' || plan || ' until ' || until AS TEXT), who
FROM leases
UNION ALL
SELECT l.ended_at, l.id, 'lease', 1, CAST(NULL AS TEXT), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(NULL AS INTEGER),
       CAST('lease of plan ' || l.plan || CASE l.ended WHEN 'taken' THEN ' became a job' WHEN 'released' THEN ' was released'
                                                   WHEN 'spoilt' THEN ' ended, its wood was written off'
                                                   ELSE ' expired' END AS TEXT),
       CAST(coalesce(d.who, '') AS TEXT)
FROM leases AS l LEFT JOIN done_by AS d ON d.kind = 'lease' AND d.number = l.id WHERE l.ended IS NOT NULL
UNION ALL
SELECT created_at, number, 'panel', 0, id, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('entered' AS TEXT), CAST('' AS TEXT)
FROM panels
UNION ALL
SELECT r.at, r.id, 'panel', 1, r.panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(CASE WHEN s.retirement IS NOT NULL THEN 'sawn apart' WHEN r.retired = 1 THEN 'retired' ELSE 'restored' END AS TEXT),
       CAST(coalesce(s.who, d.who, '') AS TEXT)
FROM retirements AS r LEFT JOIN splits AS s ON s.retirement = r.id
LEFT JOIN done_by AS d ON d.kind = 'retirement' AND d.number = r.id
WHERE NOT EXISTS (SELECT 1 FROM merges WHERE merged = r.panel AND at = r.at)
UNION ALL
SELECT at, id, 'merge', 0, merged, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('is ' || kept AS TEXT), who
FROM merges
UNION ALL
SELECT at, id, 'merge', 1, kept, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('was also ' || merged AS TEXT), who
FROM merges
UNION ALL
SELECT p.made_at, p.id, 'proposal', 0, CAST(coalesce(p.panel, v.panel) AS TEXT), CAST(NULL AS INTEGER),
       CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST('made' AS TEXT), p.who
FROM proposals AS p LEFT JOIN proposal_verdicts AS v ON v.proposal = p.id
UNION ALL
SELECT v.at, v.proposal, 'proposal', 1, CAST(coalesce(v.panel, p.panel) AS TEXT), CAST(NULL AS INTEGER),
       CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), v.verdict, v.who
FROM proposal_verdicts AS v JOIN proposals AS p ON p.id = v.proposal
UNION ALL
SELECT at, id, 'remnant', 0, panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), run, CAST('booked' AS TEXT),
       CAST('' AS TEXT)
FROM remnants
UNION ALL
SELECT taken_at, id, 'scan', 0, panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), face,
       CAST('' AS TEXT)
FROM scans
UNION ALL
SELECT made_at, version, 'mask', 0, panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('version ' || version AS TEXT), CAST('' AS TEXT)
FROM masks
UNION ALL
SELECT at, id, 'edit', 0, panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(CASE kind WHEN 'give' THEN 'gives wood' ELSE 'withholds wood' END AS TEXT), who
FROM mask_edits
UNION ALL
SELECT r.at, r.edit, 'edit', 1, e.panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('taken back' AS TEXT), r.who
FROM mask_edit_removals AS r JOIN mask_edits AS e ON e.id = r.edit
UNION ALL
SELECT t.at, t.id, 'treatment', 0, t.panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       t.kind, t.who
FROM treatments AS t
WHERE NOT EXISTS (SELECT 1 FROM parts AS s JOIN panels AS p ON p.id = s.panel
                  WHERE s.panel = t.panel AND t.at < p.created_at)
UNION ALL
SELECT found_at, id, 'difference', 0, panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       kind, CAST('' AS TEXT)
FROM differences
UNION ALL
SELECT v.at, v.id, 'difference', 1, d.panel, CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       v.verdict, v.who
FROM difference_verdicts AS v JOIN differences AS d ON d.id = v.difference
UNION ALL
SELECT at, id, 'cell', 0, CAST(NULL AS TEXT), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(CASE under_way WHEN 1 THEN doing ELSE 'at rest' END AS TEXT), CAST('' AS TEXT)
FROM activities
UNION ALL
SELECT at, id, 'cell', 1, CAST(NULL AS TEXT), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST(CASE cleared WHEN 1 THEN 'cleared' ELSE reason END AS TEXT), who
FROM aborts
UNION ALL
SELECT at, id, 'cell', 2, CAST(NULL AS TEXT), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER), CAST(NULL AS INTEGER),
       CAST('backup of ' || made_at || ' put back' AS TEXT), who
FROM restorations;
