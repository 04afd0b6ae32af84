-- A beam that left its path may have hit wood that waits for its piece, and pieces that are cut.
INSERT INTO allocation_moves VALUES ('reserved', 'suspect'), ('cut', 'suspect');
