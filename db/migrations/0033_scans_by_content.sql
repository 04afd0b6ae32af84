-- Schema 33: whether a picture was scanned before, asked of an index alone.

-- Of all that a shop ever scanned, without a walk through rows that hold a registration of hundreds of kilobytes each.
CREATE INDEX scans_by_content ON scans (sha256);
