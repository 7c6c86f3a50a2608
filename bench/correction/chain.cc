// sixpoint-bench-chain: what a machine waits for. Scans about a group of holes (the data set's airfoil scans) are stored; from then to their
// released program in one call (CorrectScans), beside the bare kernels of the same work in the same run: decoding and thinning, the fit, solving,
// writing and proving the program with what its gate computes. The plant is up, with the data set's machines calibrated
// (bench/correction/on_a_plant.py). Prints one JSON object.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "bench/correction/bare_kernels.h"
#include "bench/correction/need.h"
#include "cli/cloud_files.h"
#include "cli/plant_run/dataset.h"
#include "cli/session.h"
#include "services/clients/scan_upload.h"
#include "services/runtime/call.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr char kGroup[] = "G2";

double Seconds(Clock::time_point since) { return std::chrono::duration<double>(Clock::now() - since).count(); }

// Of its laser lines about that share, spread evenly.
metrology::Points Fewer(const metrology::Points& points_mm, double share) {
  metrology::Points fewer;
  double line = 0;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    if (i > 0 && points_mm[i].x() != points_mm[i - 1].x()) ++line;
    if (std::floor((line + 1) * share) > std::floor(line * share)) fewer.push_back(points_mm[i]);
  }
  return fewer;
}

// From hole to hole high above the part.
std::string TemplateFor(const plant::v1::Part& part) {
  std::string text = "%\nG21 G90\nG0 Z150\n";
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    if (group.group() != kGroup) continue;
    for (const plant::v1::Hole& hole : group.holes()) {
      const std::string mark = " (SIXPOINT " + group.group() + "/" + hole.hole() + ")\n";
      text +=
          "G0 A0.0000 B0.0000" + mark + "X0.0000 Y0.0000" + mark + "G1 Z0.0000 F20" + mark + "G91 Z-0.2\nG90 G0 Z150\n";
    }
  }
  return text + "M30\n%\n";
}

struct Machine {
  std::string id, blade;
  int run = 0;
};

struct Portion {
  ingest::v1::ScanHeader header;
  metrology::Points points_mm;
};

class Chain {
 public:
  Chain(cli::Session* session, const cli::Dataset& dataset, std::vector<Portion> portions)
      : session_(session), template_(TemplateFor(dataset.part)), portions_(std::move(portions)) {}

  // The stored scans.
  std::vector<std::string> Upload(Machine* machine) const {
    ++machine->run;
    std::vector<std::string> names;
    for (const Portion& portion : portions_) {
      ingest::v1::ScanHeader header = portion.header;
      header.set_scan_id(machine->id + "_" + header.scan_id() + "_" + std::to_string(machine->run) + "_" +
                         std::to_string(::getpid()));
      header.set_machine("machines/" + machine->id);
      header.set_subject("blades/" + machine->blade);
      header.set_encoding(ingest::v1::ENCODING_DRACO);
      const auto scan = Need(clients::PrepareScan(std::move(header), portion.points_mm), "scan");
      clients::UploadOptions options;
      options.retry = session_->Limits();
      names.push_back(Need(clients::UploadScan(Need(session_->ChannelTo("ingest"), "ingest"), scan, options), "upload")
                          .scan()
                          .name());
    }
    return names;
  }

  correction::v1::CorrectScansRequest RequestOf(const Machine& machine, const std::vector<std::string>& scans) const {
    correction::v1::CorrectScansRequest request;
    request.mutable_registration()->set_blade("blades/" + machine.blade);
    for (const std::string& scan : scans) request.mutable_registration()->add_scans(scan);
    request.mutable_registration()->set_method(registration::v1::METHOD_LOCAL);
    request.mutable_correction()->add_groups(kGroup);
    request.mutable_correction()->set_nc_template(template_);
    request.set_request_id(cli::NewRequestId());
    return request;
  }

  // Seconds from its stored scan to its program.
  double Correct(const Machine& machine, const std::vector<std::string>& scans,
                 correction::v1::Correction* correction) const {
    const auto channel = Need(session_->ChannelTo("correction"), "correction");
    const auto stub = correction::v1::CorrectionService::NewStub(channel);
    const correction::v1::CorrectScansRequest request = RequestOf(machine, scans);
    const auto began = Clock::now();
    const grpc::Status got = stub->CorrectScans(runtime::ContextFor(60).get(), request, correction);
    const double took_s = Seconds(began);
    if (!got.ok()) Need<int>(runtime::FromGrpc(got), "correct");
    if (correction->nc_program().empty()) {
      for (const std::string& reason : correction->release_reasons())
        std::fprintf(stderr, "sixpoint-bench-chain: no program left: %s\n", reason.c_str());
      std::exit(2);
    }
    return took_s;
  }

 private:
  cli::Session* const session_;
  const std::string template_;
  const std::vector<Portion> portions_;
};

double Percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace

int Main(int argc, char** argv) {
  CLI::App app("From a stored scan to its released program");
  cli::Session session;
  std::string folder, machines = "sarix-1";
  int runs = 60, together = 10;
  std::size_t point_count = 1'000'000;
  app.add_option("--server", session.server)->required();
  app.add_option("--identity", session.identity)->required();
  app.add_option("--dataset", folder)->required();
  app.add_option("--machine", machines, "The first; others are called MACHINE-2, -3, -4, blades alike");
  app.add_option("--runs", runs)->check(CLI::Range(3, 1000));
  app.add_option("--together", together, "Runs of four machines at once; 0: none")->check(CLI::Range(0, 1000));
  app.add_option("--points", point_count)->check(CLI::Range(10'000, 2'000'000));
  CLI11_PARSE(app, argc, argv);
  const cli::Dataset dataset = Need(cli::LoadDataset(folder), "data set");
  std::vector<Portion> portions;
  std::size_t points = 0, all_points = 0;
  for (const cli::DatasetScan& scan : dataset.scans)
    if (scan.header.kind() == ingest::v1::SCAN_KIND_AIRFOIL) all_points += static_cast<std::size_t>(scan.point_count);
  for (const cli::DatasetScan& scan : dataset.scans)
    if (scan.header.kind() == ingest::v1::SCAN_KIND_AIRFOIL) {
      portions.push_back({scan.header, Fewer(Need(cli::ReadCloud(folder + "/" + scan.file), "cloud"),
                                             static_cast<double>(point_count) / static_cast<double>(all_points))});
      points += portions.back().points_mm.size();
    }
  const Chain chain(&session, dataset, std::move(portions));
  const Channels channels = {Need(session.ChannelTo("plant"), "plant"), Need(session.ChannelTo("ingest"), "ingest"),
                             Need(session.ChannelTo("calibration"), "calibration"),
                             Need(session.ChannelTo("registration"), "registration")};
  const BareRegistration registration(channels);

  std::vector<double> chain_s, kernel_s, decode_s, fit_s, program_s;
  Machine machine{machines, "SN-0001"};
  for (int i = -2; i < runs; ++i) {  // the first two make surfaces and connections ready
    const std::vector<std::string> scans = chain.Upload(&machine);
    correction::v1::Correction made;
    const double took_s = chain.Correct(machine, scans, &made);
    const correction::v1::CorrectScansRequest request = chain.RequestOf(machine, scans);
    const RegistrationTimes times = registration.Run(request.registration());
    correction::v1::CorrectRequest of_correction = request.correction();
    of_correction.set_registration(made.registration());
    const double of_program_s = BareCorrection_s(channels, of_correction);
    if (i < 0) continue;
    chain_s.push_back(took_s);
    kernel_s.push_back(times.decode_s + times.fit_s + of_program_s);
    decode_s.push_back(times.decode_s);
    fit_s.push_back(times.fit_s);
    program_s.push_back(of_program_s);
  }
  std::vector<std::vector<double>> of_machine(4);
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < of_machine.size() && together > 0; ++k)
    threads.emplace_back([&, k] {
      Machine one{k == 0 ? machines : machines + "-" + std::to_string(k + 1),
                  k == 0 ? "SN-0001" : "SN-0001-" + std::to_string(k + 1), 100000};
      for (int i = -1; i < together; ++i) {
        const std::vector<std::string> scans = chain.Upload(&one);
        correction::v1::Correction made;
        const double took_s = chain.Correct(one, scans, &made);
        if (i >= 0) of_machine[k].push_back(took_s);
      }
    });
  for (std::thread& thread : threads) thread.join();
  std::vector<double> at_once_s;
  for (const auto& one : of_machine) at_once_s.insert(at_once_s.end(), one.begin(), one.end());

  const double bare_s = Percentile(kernel_s, 0.5);
  std::printf(
      "%zu points, %d runs: chain p50 %.3f s, p99 %.3f s; kernels p50 %.3f s (decode %.3f, fit %.3f, program %.3f), "
      "p99 %.3f s\n",
      points, runs, Percentile(chain_s, 0.5), Percentile(chain_s, 0.99), bare_s, Percentile(decode_s, 0.5),
      Percentile(fit_s, 0.5), Percentile(program_s, 0.5), Percentile(kernel_s, 0.99));
  nlohmann::json figures = {{"chain_p50_over_kernels", Percentile(chain_s, 0.5) / bare_s},
                            {"chain_p99_over_kernels", Percentile(chain_s, 0.99) / bare_s}};
  if (!at_once_s.empty()) {
    std::printf("four machines at once, each sending and waiting in turn: p50 %.3f s, p99 %.3f s\n",
                Percentile(at_once_s, 0.5), Percentile(at_once_s, 0.99));
    figures["chain_of_four_p50_over_kernels"] = Percentile(at_once_s, 0.5) / bare_s;
    figures["chain_of_four_p99_over_kernels"] = Percentile(at_once_s, 0.99) / bare_s;
  }
  std::printf("%s\n", figures.dump().c_str());
  return 0;
}

}  // namespace sixpoint::bench

int main(int argc, char** argv) { return sixpoint::bench::Main(argc, argv); }
