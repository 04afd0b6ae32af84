-- Schema 20: how many rows each table has, and their checksums in one. A page that a disk lost or left empty takes rows
-- with it that are each as they were written; here they are missed.
--
-- The triggers that keep it are made by db/table_sums.cc, for every table that has checksums when the last step is done.

CREATE TABLE table_sums (
  name TEXT PRIMARY KEY,
  rows INTEGER NOT NULL CHECK (rows >= 0),
  sum  INTEGER NOT NULL,  -- exclusive or
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('table_sums', name, rows, sum)) STORED
) STRICT, WITHOUT ROWID;
