-- Schema 3: where a piece's cut begins in waste. What that burns is part of the piece's allocation.

-- A list of one point in PanelFrame; of none where the cut begins on the piece's own edge.
ALTER TABLE pieces ADD COLUMN lead_in_um TEXT NOT NULL DEFAULT '[]';
