-- Schema 36: what happened, in one list, with leases, proposals of scans, outlines that people drew into masks, panels
-- that turned out to be one sheet and panels that were sawn apart.

DROP VIEW events;

-- What happened to wood, pieces, runs, jobs, panels and the cell. `step` orders the rows of one kind within an instant,
-- and verdicts among those of wood: a settled piece stands once, as a verdict, and a panel that was sawn apart or merged
-- once, and not as a retirement too. Of a lease that was renewed, the last renewal alone is known.
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
SELECT at, id, 'lease', NULL, NULL, NULL, NULL, 'plan ' || plan || ' until ' || until, who FROM leases
UNION ALL
SELECT ended_at, id, 'lease', NULL, NULL, NULL, NULL, 'plan ' || plan || ' ' || ended, '' FROM leases WHERE ended IS NOT NULL
UNION ALL
SELECT created_at, number, 'panel', id, NULL, NULL, NULL, 'entered', '' FROM panels
UNION ALL
SELECT r.at, r.id, 'panel', r.panel, NULL, NULL, NULL,
       CASE WHEN s.retirement IS NOT NULL THEN 'sawn apart' WHEN r.retired = 1 THEN 'retired' ELSE 'restored' END,
       coalesce(s.who, '')
FROM retirements AS r LEFT JOIN splits AS s ON s.retirement = r.id
WHERE NOT EXISTS (SELECT 1 FROM merges WHERE merged = r.panel AND at = r.at)
UNION ALL
SELECT at, id, 'merge', merged, NULL, NULL, NULL, 'is ' || kept, who FROM merges
UNION ALL
SELECT at, id, 'merge', kept, NULL, NULL, NULL, 'was also ' || merged, who FROM merges
UNION ALL
SELECT p.made_at, p.id, 'proposal', coalesce(p.panel, v.panel), NULL, NULL, NULL, 'waits', p.who
FROM proposals AS p LEFT JOIN proposal_verdicts AS v ON v.proposal = p.id
UNION ALL
SELECT v.at, v.proposal, 'proposal', coalesce(v.panel, p.panel), NULL, NULL, NULL, v.verdict, v.who
FROM proposal_verdicts AS v JOIN proposals AS p ON p.id = v.proposal
UNION ALL
SELECT taken_at, id, 'scan', panel, NULL, NULL, NULL, face, '' FROM scans
UNION ALL
SELECT made_at, version, 'mask', panel, NULL, NULL, NULL, 'version ' || version, '' FROM masks
UNION ALL
SELECT at, id, 'edit', panel, NULL, NULL, NULL, CASE kind WHEN 'give' THEN 'gives wood' ELSE 'withholds wood' END, who
FROM mask_edits
UNION ALL
SELECT r.at, r.edit, 'edit', e.panel, NULL, NULL, NULL, 'taken back', r.who
FROM mask_edit_removals AS r JOIN mask_edits AS e ON e.id = r.edit
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
