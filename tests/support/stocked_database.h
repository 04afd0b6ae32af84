// A cell's database with certificates, two panels and one job on them.
#pragma once

#include <fmt/format.h>

#include "calib/camera_fit.h"
#include "calib/machine_axes.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"

namespace veneer::tests {

inline constexpr const char* kThen = "2026-01-01T00:00:00.000Z";

inline Box<MachineFrame> whole_bed() {
  Box<MachineFrame> bed;
  bed.add(point<MachineFrame>(0, 0));
  bed.add(point<MachineFrame>(520, 380));
  return bed;
}

// Burnt with one ring in the middle of the bed and off by 0.02 mm wherever anybody asks.
inline calib::MachineAxes known_axes() {
  calib::MachineAxes axes;
  axes.error.everywhere = Millimetres(0.02);
  axes.error.measured = {point<MachineFrame>(260, 190)};
  return axes;
}

// `first` pieces of job 1 lie on P-0001, 20 mm apart, `second` on P-0002; their marks are A1-1, A1-2, ...
inline Status stock_two_panels(daemon::DatabaseThread& database, int first, int second) {
  return database.call([first, second](daemon::Repositories& r) -> Status {
    for (const char* name : {"P-0001", "P-0002"}) {
      db::PanelRecord panel;
      panel.id = PanelId{name};
      panel.name = name;
      panel.width = Millimetres(200);
      panel.height = Millimetres(100);
      panel.created_at = kThen;
      if (Status added = r.panels.add(panel, {}, {}); !added) return added;
    }
    for (const auto& [kind, payload] :
         {std::pair(db::CertificateKind::kCamera, daemon::to_payload(calib::CameraFit{}).dump()),
          std::pair(db::CertificateKind::kAxes,
                    daemon::to_payload(known_axes(), CertificateId{1}, {whole_bed()}, {}).dump()),
          std::pair(db::CertificateKind::kKerf, std::string("{\"kerf_mm\":0.27}"))}) {
      db::CertificateRecord certificate;
      certificate.kind = kind;
      certificate.issued_at = kThen;
      certificate.expires_at = "2999-01-01T00:00:00.000Z";
      certificate.payload = payload;
      if (auto issued = r.certificates.issue(certificate); !issued) return issued.error();
    }
    db::NewPlan job;
    job.name = "test";
    job.plan_json = job.options_json = "{}";
    for (int i = 0; i < first + second; ++i) {
      db::PlannedPatch& piece = job.pieces.emplace_back();
      const double x = 20 * (i < first ? i : i - first);
      piece.mark = fmt::format("A1-{}", i + 1);
      piece.artwork_outline = {point<ArtworkFrame>(x, 0), point<ArtworkFrame>(x + 10, 0),
                               point<ArtworkFrame>(x + 10, 10)};
      piece.panel = PanelId{i < first ? "P-0001" : "P-0002"};
      piece.panel_outline = {point<PanelFrame>(x, 0), point<PanelFrame>(x + 10, 0), point<PanelFrame>(x + 10, 10)};
      piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.27));
    }
    job.planned_on = {{PanelId{"P-0001"}, 1}, {PanelId{"P-0002"}, 1}};
    auto id = r.jobs.create(job, kThen);
    return id ? Ok() : Status(id.error());
  });
}

}  // namespace veneer::tests
