-- Schema 28: what is asked again and again, asked of an index alone.

-- How many pieces of a job are to be cut and how many are suspect, at each change of the cell's state: of a hundred
-- thousand without a look at their rows.
DROP INDEX allocations_to_do;
CREATE INDEX allocations_to_do ON allocations (job, state) WHERE state IN ('reserved', 'cutting', 'suspect');

-- Whether devices were ever chosen for the cell, at each start without chosen_devices.toml: without a walk through all
-- that was ever done.
CREATE INDEX choices_of_devices ON audit (what) WHERE what IN ('device.choose', 'device.choose.failed');
