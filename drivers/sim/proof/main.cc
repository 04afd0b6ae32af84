// veneer-proof: judges what the cell claims against the twin's truth.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>

#include "drivers/sim/proof/proof.h"

int main(int argc, char** argv) {
  CLI::App app{"Judges what a simulated cell claims to have done against the twin's own truth"};
  std::string state;
  std::string claims_file;
  std::string out = ".";
  int threads = 0;
  app.add_option("--twin-state", state, "state directory of veneer-twin")->required();
  app.add_option("--claims", claims_file, "claims.json as the cell tells it")->required();
  app.add_option("--out", out, "directory for proof.json and the pictures")->required();
  app.add_option("--threads", threads, "worker threads, 0 = as many as the machine has");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  // Tesseract's own threads only get in the way of ours. OpenMP reads this when the program is loaded, so it is loaded
  // anew; where that fails they do get in the way. Nothing else runs yet.
  if (std::getenv("OMP_THREAD_LIMIT") == nullptr) {  // NOLINT(concurrency-mt-unsafe)
    setenv("OMP_THREAD_LIMIT", "1", 1);              // NOLINT(concurrency-mt-unsafe)
    execv("/proc/self/exe", argv);
  }

  const auto fail = [](const veneer::Error& error) {
    std::fprintf(stderr, "veneer-proof: %s\n", error.message.c_str());
    return 1;
  };
  const auto claims = veneer::proof::load_claims(claims_file);
  if (!claims) return fail(claims.error());
  const auto truth = veneer::proof::load_truth(state, *claims);
  if (!truth) return fail(truth.error());
  const auto proof = veneer::proof::prove(*truth, *claims, threads);
  if (!proof) return fail(proof.error());
  const veneer::Status written = veneer::proof::write_proof(*proof, out);
  return written ? 0 : fail(written.error());
}
