-- Schema 35: a cut piece that is given up, because somebody says that it is lost (`job redo --lost`), has its verdict too.

DROP TRIGGER a_verdict_is_what_its_wood_became;

-- Those that were given up before: the plan by which such a piece was made again says who asked. Where several of the
-- job place it anew in one instant, the first gave it up. Of wood that moved before schema 11 nobody knows that it was
-- cut before, so that what was given up then has no verdict.
INSERT INTO verdicts (allocation, step, verdict, as_seen, who, at)
SELECT h.allocation, h.id, 'scrap', 0, n.who, h.at
FROM allocation_history AS h JOIN allocations AS a ON a.id = h.allocation JOIN pieces AS p ON p.id = a.piece
JOIN redos AS r ON r.id = (SELECT min(d.id) FROM redos AS d JOIN placements AS l ON l.plan = d.plan
                           WHERE d.job = a.job AND d.at = h.at AND l.patch = p.patch)
JOIN plans AS n ON n.id = r.plan
WHERE h.state = 'scrap'
  AND (SELECT state FROM allocation_history WHERE allocation = h.allocation AND id < h.id ORDER BY id DESC LIMIT 1) = 'cut'
ORDER BY h.id;

-- It is said in the transaction that moves the wood: its step is the newest, and the one before is what it was said of.
-- A scan tells of suspect wood alone.
CREATE TRIGGER a_verdict_is_what_its_wood_became BEFORE INSERT ON verdicts
WHEN NOT EXISTS (SELECT 1 FROM allocations WHERE id = NEW.allocation AND piece IS NOT NULL AND state = NEW.verdict)
 OR NOT EXISTS (SELECT 1 FROM allocation_history
                WHERE id = NEW.step AND allocation = NEW.allocation AND state = NEW.verdict AND at = NEW.at)
 OR EXISTS (SELECT 1 FROM allocation_history WHERE allocation = NEW.allocation AND id > NEW.step)
 OR NOT coalesce((NEW.verdict,
                  (SELECT state FROM allocation_history WHERE allocation = NEW.allocation AND id < NEW.step
                   ORDER BY id DESC LIMIT 1))
                 IN (VALUES ('cut', 'suspect'), ('scrap', 'suspect'), ('released', 'suspect'), ('scrap', 'cut'),
                            ('suspect', 'scrap')), 0)
 OR (NEW.as_seen = 1
     AND (SELECT state FROM allocation_history WHERE allocation = NEW.allocation AND id < NEW.step
          ORDER BY id DESC LIMIT 1) IS NOT 'suspect')
BEGIN
  SELECT RAISE(ABORT, 'a verdict is of a piece whose wood just became that by it');
END;
