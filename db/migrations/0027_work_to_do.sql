-- Schema 27: which jobs have pieces to cut, or suspect ones, is asked at each change of the cell's state and each end of
-- a task: without a walk through all pieces that ever were.
CREATE INDEX allocations_to_do ON allocations (job) WHERE state IN ('reserved', 'cutting', 'suspect');
