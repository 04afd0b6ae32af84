-- Schema 11: what became of wood, step by step, and on what a run stood. From these a piece tells its life.

-- Each state that an allocation entered, when, and during which run. The newest is the state it is in.
CREATE TABLE allocation_history (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  allocation INTEGER NOT NULL REFERENCES allocations (id),
  state      TEXT    NOT NULL,
  at         TEXT    NOT NULL,
  run        INTEGER REFERENCES runs (id),
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('allocation_history', id, allocation, state, at, run)) STORED
) STRICT;
CREATE INDEX allocation_history_of_wood ON allocation_history (allocation);

-- Of what happened before, the last step alone is known.
INSERT INTO allocation_history (allocation, state, at, run)
SELECT a.id, a.state, a.changed_at,
       CASE WHEN a.state IN ('cutting', 'cut', 'suspect')
            THEN (SELECT r.id FROM runs AS r
                  WHERE r.job = a.job AND r.panel = a.panel AND r.started_at <= a.changed_at
                    AND (r.ended_at IS NULL OR a.changed_at <= r.ended_at)
                  ORDER BY r.id DESC LIMIT 1) END
FROM allocations AS a ORDER BY a.id;

CREATE TRIGGER allocation_history_is_never_edited BEFORE UPDATE ON allocation_history
BEGIN
  SELECT RAISE(ABORT, 'what became of wood is never edited');
END;
CREATE TRIGGER allocation_history_is_kept BEFORE DELETE ON allocation_history
BEGIN
  SELECT RAISE(ABORT, 'what became of wood is never removed');
END;
CREATE TRIGGER wood_that_enters_is_noted AFTER INSERT ON allocations
BEGIN
  INSERT INTO allocation_history (allocation, state, at) VALUES (NEW.id, NEW.state, NEW.changed_at);
END;
CREATE TRIGGER wood_that_moves_is_noted AFTER UPDATE OF state ON allocations
BEGIN
  INSERT INTO allocation_history (allocation, state, at, run)
  VALUES (NEW.id, NEW.state, NEW.changed_at,
          (SELECT id FROM runs WHERE ended_at IS NULL AND job = NEW.job AND panel = NEW.panel));
END;

-- Who gave the word for a run, the certificates its strokes stood on, and how each wood was burnt (JSON).
CREATE TABLE run_facts (
  run          INTEGER PRIMARY KEY REFERENCES runs (id),
  who          TEXT NOT NULL CHECK (who <> ''),
  certificates TEXT NOT NULL CHECK (json_type(certificates) = 'array'),
  recipes      TEXT NOT NULL CHECK (json_type(recipes) = 'array'),
  checksum     INTEGER NOT NULL
               GENERATED ALWAYS AS (veneer_checksum('run_facts', run, who, certificates, recipes)) STORED
) STRICT;
CREATE TRIGGER run_facts_are_never_edited BEFORE UPDATE ON run_facts
BEGIN
  SELECT RAISE(ABORT, 'what a run stood on is never edited');
END;
CREATE TRIGGER run_facts_are_kept BEFORE DELETE ON run_facts
BEGIN
  SELECT RAISE(ABORT, 'what a run stood on is never removed');
END;
