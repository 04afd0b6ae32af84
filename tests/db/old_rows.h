// Rows of databases that older versions of the program wrote.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "db/migrations.h"
#include "db/sql.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

// As the first schema wrote it: two panels, a job that was aborted with pieces in every state, one patch without wood.
inline constexpr const char* kOldRows = R"sql(
INSERT INTO panels VALUES
  (1, 'P-0001', 'oak', 420000, 280000, 'map1', 'mask1', 'h1', '2026-01-01T00:00:00.000Z', NULL, 'P-0001'),
  (2, 'P-0002', 'rest', 200000, 280000, 'map2', 'mask2', 'h2', '2026-01-02T00:00:00.000Z', 'P-0001', 'P-0001');
INSERT INTO scans VALUES (1, 'P-0001', 'show', 'twin', 'f', 'ab', 600, NULL, 0.02, '[]', '2026-01-01T00:00:00.000Z');
INSERT INTO fiducials VALUES ('P-0001', 'show', 'tag', 201, '[[0,0],[1,0],[1,1],[0,1]]'),
                             ('P-0001', 'show', 'hole', 0, '[[5,5]]');
INSERT INTO jobs VALUES (7, 'portrait', 'planned', '2026-01-03T00:00:00.000Z', '2026-01-03T00:00:00.000Z', 'target',
                         'preview', '{"o":1}', '{"schema_version":1}');
INSERT INTO pieces (id, job, ordinal, mark, artwork_outline_um, panel, panel_outline_um, angle_rad, shift_x_mm,
                    shift_y_mm, improper) VALUES
  (11, 7, 0, 'A1', '[[0,0],[9000,0],[9000,9000]]', 'P-0001', '[[10000,0],[19000,0],[19000,9000]]', -0.0, 10, 0, 0),
  (12, 7, 1, 'A2', '[[0,0],[9000,0],[9000,9000]]', 'P-0002', '[[10000,0],[19000,0],[19000,9000]]', 0.5, 10, 0.25, 1),
  (13, 7, 2, 'A3', '[[0,0],[9000,0],[9000,9000]]', NULL, '[]', 0, 0, 0, 0),
  (14, 7, 3, 'A4', '[[0,0],[9000,0],[9000,9000]]', 'P-0001', '[[40000,0],[49000,0],[49000,9000]]', 0, 40, 0, 0);
INSERT INTO allocations (id, panel, job, piece, state, outline_um, area_um, reason, changed_at) VALUES
  (21, 'P-0001', 7, 11, 'reserved', '[[10000,0],[19000,0],[19000,9000]]', '[[[9000,-1000],[20000,-1000],[20000,10000]]]', '', 't1'),
  (22, 'P-0002', 7, 12, 'reserved', '[[10000,0],[19000,0],[19000,9000]]', '[[[9000,-1000],[20000,-1000],[20000,10000]]]', '', 't1'),
  (23, 'P-0001', 7, 14, 'reserved', '[[40000,0],[49000,0],[49000,9000]]', '[[[39000,-1000],[50000,-1000],[50000,10000]]]', '', 't1'),
  (24, 'P-0001', NULL, NULL, 'scrap', '[]', '[[[100000,0],[110000,0],[110000,10000]]]', 'burnt', 't0');
UPDATE jobs SET state = 'running';
INSERT INTO runs VALUES (3, 7, 'P-0001', 0.1, 1, 2, 0, 0.05, '2026-01-03T01:00:00.000Z', NULL, '');
UPDATE allocations SET state = 'cutting', changed_at = 't2' WHERE id = 21;
UPDATE allocations SET state = 'cut', changed_at = 't3' WHERE id = 21;
UPDATE allocations SET state = 'cutting' WHERE id = 23;
UPDATE allocations SET state = 'suspect', changed_at = 't4' WHERE id = 23;
UPDATE runs SET ended_at = '2026-01-03T02:00:00.000Z', result = 'stop';
UPDATE jobs SET state = 'aborted', changed_at = '2026-01-03T02:00:00.000Z';
INSERT INTO certificates VALUES (5, 'kerf', '2026-01-01T00:00:00.000Z', '2027-01-01T00:00:00.000Z', 0.01, '{"kerf_mm":0.2}');
INSERT INTO audit VALUES (9, '2026-01-01T00:00:00.000Z', 'local:1000', 'job.start', '7'),
                         (10, '2026-01-02T00:00:00.000Z', 'local:1000', 'job.cancel', '');
)sql";

// What each later schema added, as rows that it wrote while it was the newest: from these on, by its file's number.
struct RowsOfVersion {
  int version = 0;
  const char* rows = "";
};
inline constexpr RowsOfVersion kLaterRows[] = {
    {2, R"sql(
INSERT INTO zones VALUES ('P-0001', 1, '[[0,0],[200000,0],[200000,280000],[0,280000]]', 'oak');
INSERT INTO recipes VALUES ('oak', 'cut', 12, 0.6, 1, 1, 210, 170, 't');)sql"},
    {3, R"sql(
INSERT INTO jobs VALUES (8, 'leaf', 'planned', 't5', 't5', 'target', 'preview', '{}', '{"schema_version":1}');
INSERT INTO pieces (id, job, ordinal, mark, artwork_outline_um, panel, panel_outline_um, angle_rad, shift_x_mm,
                    shift_y_mm, improper, lead_in_um) VALUES
  (15, 8, 0, 'L1', '[[0,0],[9000,0],[9000,9000],[0,9000]]', 'P-0001',
   '[[60000,0],[69000,0],[69000,9000],[60000,9000]]', 0, 60, 0, 0, '[[58650,9150]]');
INSERT INTO allocations (id, panel, job, piece, state, outline_um, area_um, reason, changed_at) VALUES
  (25, 'P-0001', 8, 15, 'reserved', '[[60000,0],[69000,0],[69000,9000],[60000,9000]]',
   '[[[59700,-300],[69300,-300],[69300,9300],[58500,9300],[58500,9000],[59700,9000]]]', '', 't5');)sql"},
    {5, R"sql(
INSERT INTO masks VALUES ('P-0002', 2, 'map3', 'mask3', 'h3', 't6');
INSERT INTO request_keys VALUES ('local:1000', 'newJob', 'k', 'h', NULL, NULL, 't6');)sql"},
    {7, "INSERT INTO lasers (identity, after_certificate, found_at) VALUES ('Grbl', 5, 't7');"},
    {8, "INSERT INTO mask_areas (panel, version, usable_um2) VALUES ('P-0002', 2, 1000000);"},
    {9, R"sql(
INSERT INTO panels (id, name, width_um, height_um, created_at, root) VALUES ('P-0003', 'ash', 300000, 200000, 't8',
                                                                             'P-0003');
INSERT INTO masks (panel, version, map_file, mask_file, map_hash, made_at) VALUES ('P-0003', 1, 'map4', 'mask4', 'h4',
                                                                                   't8');
INSERT INTO allocations (id, panel, state, area_um, reason, changed_at) VALUES
  (26, 'P-0003', 'scrap', '[[[100000,0],[110000,0],[110000,10000]]]', 'burnt', 't8');
INSERT INTO retirements (panel, retired, reason, at) VALUES ('P-0003', 1, 'lent', 't8'), ('P-0003', 0, 'back', 't9');
)sql"},
    {10, R"sql(
INSERT INTO plans (id, name, parent, who, created_at, target_file, preview_file, plan_json, options_json, report_json)
VALUES (20, 'redo', 7, 'local:1000', 't9', 'target', 'preview', '{"schema_version":1,"redo":1}', '{}', '{}');
INSERT INTO redos (job, plan, at) VALUES (7, 20, 't9');)sql"},
    {11, R"sql(
INSERT INTO run_facts (run, who, certificates, recipes) VALUES (3, 'local:1000', '[5]', '[{"material":"oak"}]');)sql"},
    {12, R"sql(
INSERT INTO differences (id, panel, kind, place_um, shape_um, area_um2, pieces, found_at) VALUES
  (1, 'P-0001', 'gone_not_booked', '[[1,1]]', '[[[0,0],[5,0],[5,5]]]', 12, '[]', 't10');
INSERT INTO difference_verdicts (difference, verdict, who, note, at) VALUES (1, 'accepted', 'local:1000', 'a chip',
                                                                             't10');)sql"},
    {15, R"sql(
INSERT INTO material_facts (material, botanical_name, who, at) VALUES ('oak', 'Quercus robur', 'local:1000', 't11');
INSERT INTO panel_facts (panel, shelf, veneer_um, who, at) VALUES ('P-0001', 'A3', 600, 'local:1000', 't11');
INSERT INTO treatments (panel, kind, product, treated_at, who, at) VALUES
  ('P-0002', 'sanding', 'grit 240', '2026-01-01', 'local:1000', 't11');)sql"},
    {16, "INSERT INTO restorations (made_at, last_scan, who, at) VALUES ('t11', 1, 'local:1000', 't12');"},
    {17, R"sql(
INSERT INTO leases (id, plan, who, at, until) VALUES (1, 20, 'local:1000', 't12', 't9999');
INSERT INTO allocations (id, panel, lease, state, area_um, reason, changed_at) VALUES
  (27, 'P-0001', 1, 'leased', '~120000,0 10000,0 0,10000', '', 't12');
UPDATE leases SET ended = 'released', ended_at = 't13' WHERE id = 1;)sql"},
    {18, R"sql(
UPDATE allocations SET state = 'released', changed_at = 't14' WHERE id = 25;
UPDATE jobs SET state = 'cancelled', changed_at = 't14' WHERE id = 8;
INSERT INTO archivings (job, archived, at) VALUES (8, 1, 't14');)sql"},
    {19, R"sql(
INSERT INTO retirements (id, panel, retired, reason, at) VALUES (9, 'P-0003', 1, 'sawn apart', 't15');
INSERT INTO splits (retirement, who) VALUES (9, 'local:1000');
INSERT INTO panels (id, name, width_um, height_um, created_at, parent, root) VALUES
  ('P-0004', 'part', 150000, 200000, 't15', 'P-0003', 'P-0003');
INSERT INTO masks (panel, version, map_file, mask_file, map_hash, made_at) VALUES ('P-0004', 1, 'map5', 'mask5', 'h5',
                                                                                   't15');
INSERT INTO parts (panel, angle_rad, shift_x_mm, shift_y_mm, improper, fiducials, rms_mm) VALUES
  ('P-0004', 0, -50, 0, 0, 3, 0.02);
INSERT INTO allocations (id, panel, state, area_um, reason, changed_at) VALUES
  (28, 'P-0004', 'scrap', '~50000,0 10000,0 0,10000', 'burnt', 't15');
INSERT INTO carried (allocation, origin, outline_um) VALUES (28, 26, '[[53000,1000],[59000,1000],[59000,7000]]');)sql"},
    {21, R"sql(
INSERT INTO sightings (allocation, step, seen, gone, mask_version, at)
SELECT 23, max(id), 'cut', 0.97, 1, 't16' FROM allocation_history WHERE allocation = 23;)sql"},
    {22, R"sql(
INSERT INTO proposals (id, who, made_at, map_file, mask_file, read_file, read_sha256, scan_files, tags, width_um,
                       height_um, usable_um2, lost_um2, gained_um2, warnings) VALUES
  (1, 'local:1000', 't17', 'm', 'k', 'r', printf('%064d', 0), '["s"]', '[301]', 100, 100, 100, 0, 0, '[]');
INSERT INTO proposal_verdicts (proposal, verdict, overruled, who, note, at) VALUES (1, 'refused', '[]', 'local:1000',
                                                                                   'dust', 't17');
INSERT INTO mask_edits (id, panel, kind, shape_um, who, note, at) VALUES (1, 'P-0001', 'give', '~0,0 9,0 0,9',
                                                                          'local:1000', '', 't17');
INSERT INTO masks (panel, version, map_file, mask_file, map_hash, made_at) VALUES ('P-0001', 2, 'map1', 'mask6', 'h1',
                                                                                   't17');
INSERT INTO painted_masks (panel, version, seen_file) VALUES ('P-0001', 2, 'mask1');
INSERT INTO mask_edit_removals (edit, who, at) VALUES (1, 'local:1000', 't18');
INSERT INTO merges (kept, merged, angle_rad, shift_x_mm, shift_y_mm, improper, fiducials, rms_mm, last_scan, who, at)
VALUES ('P-0002', 'P-0003', 0, 0, 0, 0, 4, 0.01, 0, 'local:1000', 't18');)sql"},
    {23, R"sql(
INSERT INTO remnants (panel, mask_version, run, counted_of, woods, square_um, circle_um, fitting, picture_file, at)
VALUES ('P-0001', 2, 3, 'h1', '{"oak":9}', '[1,2,3]', '[]', '{"-1 14 ":9}', 'left.png', 't19');
INSERT INTO kept_cuts (piece, run, laser, strokes) VALUES (11, 3, 'Grbl 1.1h', '[]');)sql"},
    {24, R"sql(
INSERT INTO users (name, role, password, made_at, changed_at) VALUES ('anna', 'operator', '$argon2id$v=19$x', 't20',
                                                                      't20');
INSERT INTO credentials (secret, kind, user, name, role, made_at, expires_at) VALUES
  (printf('%064d', 1), 'token', 'anna', 'backup', 'viewer', 't20', 't21');)sql"},
    {25, R"sql(
INSERT INTO scans (panel, face, device, file, sha256, dpi, rms_mm, max_mm, lattice, taken_at) VALUES
  ('P-0001', 'show', 'flatbed', 's5', printf('%064d', 5), 300, 0.01, 0.02, '#64,1,1;??', 't22');)sql"},
    {29, "INSERT INTO assemblies (allocation, assembled, who, at) VALUES (21, 1, 'local:1000', 't23');"},
    {30, "INSERT INTO proofs (run, step, at) VALUES (3, NULL, 't24');"},
    {31, "INSERT INTO aborts (cleared, who, reason, at) VALUES (0, 'veneerd', 'STOP by anna', 't25');"},
    {32, "INSERT INTO activities (under_way, doing, at) VALUES (1, 'while the head was jogged', 't26');"},
    // Five people have pieces made again, four of them at t28: dora of another job of the same plan, bert a piece that
    // he had called lost while it was suspect, anna one that was cut, and once its new wood was released, erik. It is
    // cut from that, and given up by carl.
    {34, R"sql(
UPDATE allocations SET state = 'suspect', changed_at = 't27' WHERE id = 21;
UPDATE allocations SET state = 'cut', changed_at = 't27' WHERE id = 21;
INSERT INTO verdicts (allocation, step, verdict, as_seen, who, at)
SELECT 21, max(id), 'cut', 0, 'local:1000', 't27' FROM allocation_history WHERE allocation = 21;
UPDATE jobs SET state = 'running', changed_at = 't27' WHERE id = 7;
INSERT INTO runs VALUES (4, 7, 'P-0002', 0, 0, 0, 0, 0.05, 't27', NULL, '');
UPDATE allocations SET state = 'cutting', changed_at = 't27' WHERE id = 22;
UPDATE allocations SET state = 'cut', changed_at = 't27' WHERE id = 22;
UPDATE runs SET ended_at = 't27', result = 'stopped' WHERE id = 4;
UPDATE jobs SET state = 'stopped', changed_at = 't27' WHERE id = 7;
INSERT INTO jobs (id, name, plan, state, created_at, changed_at)
SELECT 9, 'once more', plan, 'planned', 't27', 't27' FROM jobs WHERE id = 7;
INSERT INTO pieces (id, job, patch) SELECT 16, 9, patch FROM pieces WHERE id = 11;
INSERT INTO plans (id, name, parent, who, created_at, target_file, preview_file, plan_sha256, plan_bytes, options_json,
                   report_json)
SELECT n.column1, 'again', n.column2, n.column3, n.column4, 'target', 'preview', p.plan_sha256, p.plan_bytes, '{}', '{}'
FROM plans AS p, (VALUES (21, 20, 'user anna', 't28'), (22, 20, 'user bert', 't28'), (23, 21, 'user carl', 't30'),
                         (24, 7, 'user dora', 't28'), (25, 21, 'user erik', 't28')) AS n WHERE p.id = 20;
INSERT INTO plan_panels (plan, panel, mask_version) SELECT id, 'P-0002', 2 FROM plans WHERE id BETWEEN 21 AND 25;
INSERT INTO placements (plan, patch, panel, panel_outline_um, area_um, angle_rad, shift_x_mm, shift_y_mm, improper,
                        lead_in_um)
SELECT n.id, p.patch, 'P-0002', '=??S??S', '=??S??S', 0, 0, 0, 0, '[]'
FROM plans AS n JOIN pieces AS p ON p.id = CASE n.id WHEN 22 THEN 12 ELSE 11 END WHERE n.id BETWEEN 21 AND 25;
INSERT INTO redos (job, plan, at) VALUES (9, 24, 't28');
UPDATE allocations SET state = 'suspect', changed_at = 't28' WHERE id = 22;
UPDATE allocations SET state = 'scrap', changed_at = 't28' WHERE id = 22;
INSERT INTO verdicts (allocation, step, verdict, as_seen, who, at)
SELECT 22, max(id), 'scrap', 0, 'user bert', 't28' FROM allocation_history WHERE allocation = 22;
INSERT INTO redos (job, plan, at) VALUES (7, 22, 't28');
UPDATE allocations SET state = 'scrap', changed_at = 't28' WHERE id = 21;
INSERT INTO redos (job, plan, at) VALUES (7, 21, 't28');
INSERT INTO allocations (id, panel, job, piece, placement, state, area_um, outline_um, lead_in_um, reason, changed_at)
SELECT 29, 'P-0002', 7, 11, id, 'reserved', area_um, panel_outline_um, '~', '', 't28' FROM placements WHERE plan = 21;
UPDATE allocations SET state = 'released', changed_at = 't28' WHERE id = 29;
INSERT INTO redos (job, plan, at) VALUES (7, 25, 't28');
INSERT INTO allocations (id, panel, job, piece, placement, state, area_um, outline_um, lead_in_um, reason, changed_at)
SELECT 30, 'P-0002', 7, 11, id, 'reserved', area_um, panel_outline_um, '~', '', 't28' FROM placements WHERE plan = 25;
UPDATE jobs SET state = 'running', changed_at = 't29' WHERE id = 7;
INSERT INTO runs VALUES (5, 7, 'P-0002', 0, 0, 0, 0, 0.05, 't29', NULL, '');
UPDATE allocations SET state = 'cutting', changed_at = 't29' WHERE id = 30;
UPDATE allocations SET state = 'cut', changed_at = 't29' WHERE id = 30;
INSERT INTO kept_cuts (piece, run, laser, strokes) VALUES (11, 5, 'Grbl 1.1h', '[]');
UPDATE runs SET ended_at = 't29', result = 'stopped' WHERE id = 5;
UPDATE jobs SET state = 'stopped', changed_at = 't29' WHERE id = 7;
UPDATE allocations SET state = 'scrap', changed_at = 't30' WHERE id = 30;
INSERT INTO redos (job, plan, at) VALUES (7, 23, 't30');)sql"},
    {37, R"sql(
INSERT INTO zone_confidences (panel, number, confidence) VALUES ('P-0001', 1, 0.75);
INSERT INTO zones (panel, number, outline_um, material) VALUES ('P-0001', 2, '~0,0 9000,0 0,9000', '');
INSERT INTO zone_versions (panel, number, version, outline_um, who, at) VALUES ('P-0001', 2, 2, '~', 'uid 7', 't31');
INSERT INTO asked_strips (proposal, number, outline_um, confidence, taken, reason)
SELECT id, 1, '[[0,0],[9000,0],[9000,9000],[0,9000]]', 0.25, 0, 'one of its sides cannot be seen' FROM proposals;)sql"},
    {38, "INSERT INTO done_by (kind, number, who) SELECT 'job', max(id), 'user carl' FROM job_history;"},
    {39, R"sql(
INSERT INTO queue_orders (job, jobs, who, at)
SELECT max(id), '[' || max(id) || ',' || min(id) || ']', 'user anna', 't32' FROM jobs;)sql"},
    {40, "INSERT INTO done_by (kind, number, who) SELECT 'made', max(id), 'user carl' FROM jobs;"},
};

// A database that was in use up to `version`: every schema added rows of its own while it was the newest.
inline void grow(SQLite::Database& old, int version) {
  register_functions(old);
  old.exec("PRAGMA foreign_keys = ON; PRAGMA application_id = 1447970130");  // "VNER"
  for (int step = 1; step <= version; ++step) {
    VENEER_ASSERT_OK(migrate(old, migrations().first(static_cast<std::size_t>(step))));
    if (step == 1) old.exec(kOldRows);
    for (const auto& [of, rows] : kLaterRows)
      if (of == step) old.exec(rows);
  }
}

}  // namespace veneer::db
