// Ingest and PostgreSQL are killed while machines stream: what was acknowledged is there afterwards, once,
// point for point.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "services/clients/scans.h"
#include "simulator/plant_link.h"
#include "simulator/registry.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

constexpr int kMachines = 2, kScansEach = 12, kBlows = 6;
// The server's default bound, 0.25 um, and the last bits of sums of tens of millimetres.
constexpr double kBound_mm = 0.25e-3 + 1e-9;

struct SentScan {
  ingest::v1::ScanHeader header;
  simulator::ScanProfiles profiles;
};

TEST(AcknowledgedScans, SurviveTheDeathOfIngestAndOfTheDatabase) {
  ThrowawayDatabase database;
  PlantProcesses plant(database.conninfo());
  std::atomic<int> retries{0};
  auto link =
      simulator::PlantLink::Connect(plant.server(), plant.credentials(), 60, [&](const std::string&) { ++retries; });
  ASSERT_TRUE(link.ok()) << link.status() << plant.Logs();
  const simulator::MachineDesign design;
  const simulator::ArtefactGeometry geometry;
  const auto artefact = simulator::RegisterArtefact(**link, "plate", geometry);
  ASSERT_TRUE(artefact.ok()) << artefact.status() << plant.Logs();

  std::vector<std::vector<SentScan>> scans(kMachines);
  for (int m = 0; m < kMachines; ++m) {
    const auto machine = simulator::RegisterMachine(**link, "m" + std::to_string(m), design);
    ASSERT_TRUE(machine.ok()) << machine.status();
    const simulator::MachineTruth truth = simulator::MountedByHand(design, static_cast<std::uint64_t>(m));
    simulator::ScanPlan plan = simulator::PlanArtefact(design)[0];
    plan.pitch_mm = 0.4;
    for (int i = 0; i < kScansEach; ++i) {
      auto profiles = simulator::Scan(simulator::ArtefactScene(geometry, truth), truth, design.scanner, plan,
                                      static_cast<std::uint64_t>(100 * m + i), 1);
      ingest::v1::ScanHeader header;
      header.set_scan_id("m" + std::to_string(m) + "-" + std::to_string(i));
      header.set_machine(*machine);
      header.set_subject(*artefact);
      header.set_kind(ingest::v1::SCAN_KIND_ARTEFACT);
      header.mutable_v0_mm()->set_x_mm(plan.v0_mm.x());
      header.mutable_v0_mm()->set_y_mm(plan.v0_mm.y());
      header.mutable_v0_mm()->set_z_mm(plan.v0_mm.z());
      header.set_profile_pitch_mm(plan.pitch_mm);
      header.set_columns_per_profile(design.scanner.columns);
      header.set_raw_step_um(design.scanner.raw_step_um);
      scans[static_cast<std::size_t>(m)].push_back({header, std::move(profiles)});
    }
  }

  std::atomic<int> acknowledged{0}, failed{0}, working{kMachines};
  std::vector<std::thread> machines;
  for (const auto& of_machine : scans) {
    machines.emplace_back([&] {
      for (const SentScan& scan : of_machine) {
        // About a third of a second each, so that blows fall into uploads.
        const auto stored = (*link)->Upload(scan.header, scan.profiles, 200);
        stored.ok() ? ++acknowledged : ++failed;
        if (!stored.ok()) ADD_FAILURE() << scan.header.scan_id() << ": " << stored.status();
      }
      --working;
    });
  }
  int blows = 0;
  for (; blows < kBlows && working > 0; ++blows) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + 70 * blows));
    if (blows == kBlows / 2) {
      ThrowawayDatabase::KillServer();
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      ThrowawayDatabase::StartServer();
    } else {
      plant.Kill("ingest");
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      plant.Start("ingest");
    }
  }
  for (std::thread& machine : machines) machine.join();
  EXPECT_EQ(blows, kBlows) << "the uploads ended too early for the test to mean something";
  EXPECT_GT(retries, 0);
  ASSERT_EQ(acknowledged, kMachines * kScansEach) << plant.Logs();

  // A fresh process reads them back.
  plant.Kill("ingest");
  plant.Start("ingest");
  ASSERT_TRUE(plant.WaitUntilUp("ingest", 30));
  const clients::ScanClient client(runtime::ConnectTo(plant.address("ingest"), plant.credentials()));
  for (const auto& of_machine : scans) {
    for (const SentScan& scan : of_machine) {
      auto context = runtime::ContextFor(30);
      context->set_wait_for_ready(true);
      const auto fetched = client.Fetch("scans/" + scan.header.scan_id(), std::move(context));
      ASSERT_TRUE(fetched.ok()) << fetched.status();
      const metrology::Points sent_mm = simulator::PointsOf(scan.profiles);
      ASSERT_EQ(fetched->scan.points_mm.size(), sent_mm.size()) << scan.header.scan_id();
      double worst_mm = 0;
      for (std::size_t i = 0; i < sent_mm.size(); ++i)
        worst_mm = std::max(worst_mm, (fetched->scan.points_mm[i] - sent_mm[i]).cwiseAbs().maxCoeff());
      EXPECT_LE(worst_mm, kBound_mm) << scan.header.scan_id();
    }
  }
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto counts = transaction->Execute(
      "SELECT (SELECT count(*) FROM scans), (SELECT count(*) FROM record_entries WHERE kind = 'scan'), "
      "(SELECT count(*) FROM scan_blocks b WHERE NOT EXISTS (SELECT 1 FROM scans s WHERE s.scan_key = b.scan_key))");
  ASSERT_TRUE(counts.ok()) << counts.status();
  EXPECT_EQ(counts->Int(0, 0), kMachines * kScansEach);
  EXPECT_EQ(counts->Int(0, 1), kMachines * kScansEach);
  EXPECT_EQ(counts->Int(0, 2), 0);
}

}  // namespace
}  // namespace sixpoint::testing
