-- Schema 9: panels that left the stock, or came back into it.

-- A panel is what its newest row says; one without a row is in stock.
CREATE TABLE retirements (
  id      INTEGER PRIMARY KEY AUTOINCREMENT,
  panel   TEXT    NOT NULL REFERENCES panels (id),
  retired INTEGER NOT NULL CHECK (retired IN (0, 1)),
  reason  TEXT    NOT NULL CHECK (reason <> ''),
  at      TEXT    NOT NULL,
  checksum INTEGER NOT NULL GENERATED ALWAYS AS (veneer_checksum('retirements', id, panel, retired, reason, at)) STORED
) STRICT;
CREATE INDEX retirements_of_panel ON retirements (panel);

CREATE TRIGGER retirements_are_never_edited BEFORE UPDATE ON retirements
BEGIN
  SELECT RAISE(ABORT, 'that a panel left the stock is never edited');
END;
CREATE TRIGGER retirements_are_kept BEFORE DELETE ON retirements
BEGIN
  SELECT RAISE(ABORT, 'that a panel left the stock is never removed');
END;
CREATE TRIGGER retired_panels_hold_no_open_piece BEFORE INSERT ON retirements
WHEN NEW.retired = 1
 AND EXISTS (SELECT 1 FROM allocations WHERE panel = NEW.panel AND state IN ('reserved', 'cutting', 'suspect'))
BEGIN
  SELECT RAISE(ABORT, 'a panel with pieces that are not cut yet stays in stock');
END;
CREATE TRIGGER wood_of_retired_panels_is_not_reserved BEFORE INSERT ON allocations
WHEN (SELECT retired FROM retirements WHERE panel = NEW.panel ORDER BY id DESC LIMIT 1) = 1
BEGIN
  SELECT RAISE(ABORT, 'this panel was retired');
END;
