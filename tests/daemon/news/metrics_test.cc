// Figures for Prometheus.
#include "daemon/news/metrics.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

CellView cutting(CellState state, int cut, int suspect = 0) {
  CellView view;
  view.state = state;
  view.job.emplace();
  view.job->id = JobId{7};
  view.job->cut = cut;
  view.job->suspect = suspect;
  return view;
}

TEST(Metrics, CountsPiecesAndJobsByWhatDiffers) {
  Metrics metrics;
  // Four were cut on another day.
  metrics.follow(cutting(CellState::kExecute, 4), true);
  metrics.follow(cutting(CellState::kExecute, 6), true);
  metrics.follow(cutting(CellState::kAborted, 7, 1), false);
  metrics.follow(cutting(CellState::kAborted, 7, 1), false);
  metrics.follow(cutting(CellState::kClearing, 7, 1), false);
  metrics.follow(cutting(CellState::kStopped, 7, 1), false);
  EXPECT_THAT(
      metrics.text({}),
      AllOf(HasSubstr("veneerd_pieces_total{became=\"cut\"} 3\n"),
            HasSubstr("veneerd_pieces_total{became=\"suspect\"} 1\n"),
            HasSubstr("veneerd_jobs_total{outcome=\"aborted\"} 1\n"),
            HasSubstr("veneerd_jobs_total{outcome=\"stopped\"} 0\n"), HasSubstr("veneerd_state{state=\"Stopped\"} 1\n"),
            HasSubstr("veneerd_state{state=\"Idle\"} 0\n"), HasSubstr("veneerd_laser_connected 0\n")));
}

TEST(Metrics, WhatWasNotCutAgainEndsNoJob) {
  Metrics metrics;
  for (const CellState state : {CellState::kExecute, CellState::kCompleting, CellState::kComplete,
                                // A recut that the camera refuses.
                                CellState::kCompleting, CellState::kComplete})
    metrics.follow(cutting(state, 6), true);
  EXPECT_THAT(metrics.text({}), HasSubstr("veneerd_jobs_total{outcome=\"complete\"} 1\n"));
  for (const CellState state : {CellState::kExecute, CellState::kCompleting, CellState::kComplete})
    metrics.follow(cutting(state, 6), true);
  EXPECT_THAT(metrics.text({}), HasSubstr("veneerd_jobs_total{outcome=\"complete\"} 2\n"));
}

TEST(Metrics, AreInPrometheusFormat) {
  Metrics metrics;
  AlarmBook alarms;
  alarms.take({{"held", false, "the lid was opened"}}, "2026-05-01T07:30:00.000Z");
  metrics.task_ended("scan", "failed");
  metrics.stop_taken(std::chrono::milliseconds(3));
  EXPECT_THAT(metrics.text({5, 2, 9, &alarms}),
              AllOf(HasSubstr("# TYPE veneerd_stop_to_wire_seconds histogram\n"),
                    HasSubstr("veneerd_stop_to_wire_seconds_bucket{le=\"0.001\"} 0\n"),
                    HasSubstr("veneerd_stop_to_wire_seconds_bucket{le=\"0.005\"} 1\n"),
                    HasSubstr("veneerd_tasks_total{kind=\"scan\",outcome=\"failed\"} 1\n"),
                    HasSubstr("veneerd_connections{of=\"events\"} 2\n"), HasSubstr("veneerd_panels 9\n"),
                    HasSubstr("veneerd_alarms{state=\"new\"} 1\n"), Not(HasSubstr("{}"))));
}

}  // namespace
}  // namespace veneer::daemon
