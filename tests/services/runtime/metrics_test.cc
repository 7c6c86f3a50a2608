// What is counted is exact, and what strangers think of makes no series.
#include "services/runtime/metrics.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <thread>

#include "services/runtime/call_metrics.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/denials.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The lines that begin so, without comments.
std::vector<std::string> Lines(const std::string& beginning) {
  std::istringstream text(ExpositionText());
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);)
    if (line.rfind(beginning, 0) == 0) lines.push_back(line);
  return lines;
}
// Of the one series that is written so.
double ExposedValue(const std::string& series) {
  const std::vector<std::string> lines = Lines(series + " ");
  EXPECT_EQ(lines.size(), 1u) << series;
  return lines.empty() ? -1 : std::stod(lines[0].substr(series.size() + 1));
}

void InThreads(int count, const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) threads.emplace_back([&work, i] { work(i); });
  for (std::thread& thread : threads) thread.join();
}

TEST(Metrics, AreExactFromManyThreads) {
  Counter counter("test_exact_total", "Of the test.");
  Gauge gauge("test_exact", "Of the test.");
  Histogram histogram("test_exact_seconds", "Of the test.", {1, 2});
  CounterBy by("test_exact_by_total", "Of the test.", "kind", {"a", "b"}, {"c"});
  InThreads(8, [&](int thread) {
    for (int i = 0; i < 5000; ++i) {
      counter.Add();
      gauge.Add(thread % 2 == 0 ? 1 : -1);
      histogram.Observe(1.5);
      by.Add(i % 2 == 0 ? "a" : "c");
      if (i % 500 == 0) ExpositionText();  // who looks holds up nobody and changes nothing
    }
  });
  EXPECT_EQ(ExposedValue("test_exact_total"), 40'000);
  EXPECT_EQ(ExposedValue("test_exact"), 0);
  EXPECT_EQ(ExposedValue("test_exact_seconds_count"), 40'000);
  EXPECT_EQ(ExposedValue("test_exact_seconds_sum"), 60'000);
  EXPECT_EQ(ExposedValue("test_exact_seconds_bucket{le=\"1\"}"), 0);
  EXPECT_EQ(ExposedValue("test_exact_seconds_bucket{le=\"2\"}"), 40'000);
  EXPECT_EQ(ExposedValue("test_exact_by_total{kind=\"a\"}"), 20'000);
  EXPECT_EQ(ExposedValue("test_exact_by_total{kind=\"b\"}"), 0);
  EXPECT_EQ(ExposedValue("test_exact_by_total{kind=\"c\"}"), 20'000);
}

TEST(Metrics, OfOneNameAreOne) {
  Counter("test_once_total", "Of the test.").Add(2);
  Counter("test_once_total", "Of the test.").Add(3);
  EXPECT_EQ(ExposedValue("test_once_total"), 5);
}

TEST(Metrics, InventedValuesOfALabelAreOneSeries) {
  CounterBy by("test_invented_total", "Of the test.", "reason", {"KNOWN"}, {"SELDOM"});
  EXPECT_EQ(Lines("test_invented_total").size(), 1u);
  for (int i = 0; i < 10'000; ++i) by.Add("invented " + std::to_string(i));
  by.Add("SELDOM");
  EXPECT_EQ(Lines("test_invented_total").size(), 3u);
  EXPECT_EQ(ExposedValue("test_invented_total{reason=\"other\"}"), 10'000);
}

TEST(Metrics, TenThousandMachinesAreAsManySeriesAsMayBe) {
  Readings readings("test_machines_seconds", "Of the test.", {"machine"});
  std::vector<Reading> many;
  for (int i = 0; i < 10'000; ++i) many.push_back({{"machine-" + std::to_string(i)}, 1.0 * i});
  readings.Set(std::move(many));
  EXPECT_EQ(Lines("test_machines_seconds").size(), Computed::kMostReadings);
}

TEST(Metrics, WhatIsNotKnownIsNotThere) {
  {
    Readings readings("test_unknown_seconds", "Of the test.", {"machine"});
    EXPECT_THAT(ExpositionText(), Not(HasSubstr("test_unknown_seconds")));
    readings.Set({{{"m1"}, 0}});
    EXPECT_EQ(ExposedValue("test_unknown_seconds{machine=\"m1\"}"), 0);
    readings.Forget();
    EXPECT_THAT(ExpositionText(), Not(HasSubstr("test_unknown_seconds")));
    readings.Set({{{"m1"}, 7}});
  }
  EXPECT_THAT(ExpositionText(), Not(HasSubstr("test_unknown_seconds")));
}

TEST(Metrics, LabelsAreEscaped) {
  Readings readings("test_escaped", "Of the test.", {"text"});
  readings.Set({{{"a\"b\\c\nd"}, 1}});
  EXPECT_EQ(ExposedValue(R"(test_escaped{text="a\"b\\c\nd"})"), 1);
}

TEST(CallMetrics, CountCallsByMethodAndCode) {
  ASSERT_NE(plant::v1::GetMachineRequest::descriptor(), nullptr);  // linked in, and with it its service
  CountCallsOf("sixpoint.plant.v1.PlantService");
  CallCounts* const get = CallCountsOf("/sixpoint.plant.v1.PlantService/GetMachine");
  const std::string labels =
      "grpc_method=\"GetMachine\",grpc_service=\"sixpoint.plant.v1.PlantService\",grpc_type=\"unary\"";
  EXPECT_EQ(ExposedValue("grpc_server_handled_total{grpc_code=\"OK\"," + labels + "}"), 0);  // from the start
  InThreads(8, [&](int) {
    for (int i = 0; i < 1000; ++i) {
      CallBegins(get);
      CallEnds(get, i % 4 == 0 ? grpc::StatusCode::NOT_FOUND : grpc::StatusCode::OK, std::chrono::milliseconds(30));
    }
  });
  EXPECT_EQ(ExposedValue("grpc_server_started_total{" + labels + "}"), 8000);
  EXPECT_EQ(ExposedValue("grpc_server_handled_total{grpc_code=\"OK\"," + labels + "}"), 6000);
  EXPECT_EQ(ExposedValue("grpc_server_handled_total{grpc_code=\"NotFound\"," + labels + "}"), 2000);
  EXPECT_EQ(ExposedValue("grpc_server_handling_seconds_count{" + labels + "}"), 8000);
  EXPECT_EQ(ExposedValue("grpc_server_handling_seconds_bucket{" + labels + ",le=\"0.025\"}"), 0);
  EXPECT_EQ(ExposedValue("grpc_server_handling_seconds_bucket{" + labels + ",le=\"0.05\"}"), 8000);
  CallEnds(get, 99, {});  // a code that there is not
  EXPECT_EQ(ExposedValue("grpc_server_handled_total{grpc_code=\"Unknown\"," + labels + "}"), 1);
}

// A call takes a hundred microseconds and more; counting it, well below one. The bound is for a machine that does much else.
TEST(CallMetrics, CostNextToNothing) {
  CallCounts* const get = CallCountsOf("/sixpoint.plant.v1.PlantService/GetMachine");
  constexpr int kCalls = 200'000;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kCalls; ++i) {
    CallBegins(CallCountsOf("/sixpoint.plant.v1.PlantService/GetMachine"));
    CallEnds(get, grpc::StatusCode::OK, std::chrono::milliseconds(30));
  }
  const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
  std::printf("counting one call: %.0f ns\n", taken.count() / kCalls);
  EXPECT_LT(taken.count() / kCalls, 20'000);
}

TEST(CallMetrics, TenThousandInventedMethodsAreOne) {
  CallCounts* const other = CallCountsOf("/sixpoint.plant.v1.PlantService/Invented");
  const std::size_t before = Lines("").size();
  for (int i = 0; i < 10'000; ++i) {
    CallCounts* const counts = CallCountsOf("/sixpoint.plant.v1.PlantService/Invented" + std::to_string(i));
    ASSERT_EQ(counts, other);
    CallBegins(counts);
    CallEnds(counts, grpc::StatusCode::UNIMPLEMENTED, {});
  }
  EXPECT_EQ(Lines("").size(), before);
  EXPECT_EQ(ExposedValue("grpc_server_handled_total{grpc_code=\"Unimplemented\",grpc_method=\"other\","
                         "grpc_service=\"other\",grpc_type=\"unary\"}"),
            10'000);
}

TEST(DenialMetrics, CountByReason) {
  Denials denials("test");
  const std::string known = "sixpoint_denials_total{reason=\"ROLE_MISSING\"}",
                    other = "sixpoint_denials_total{reason=\"other\"}";
  const double before = ExposedValue(known);
  for (int i = 0; i < 300; ++i) denials.Add("m", "users/" + std::to_string(i), "here", "ROLE_MISSING", "why");
  for (int i = 0; i < 300; ++i) denials.Add("m", "", "here", "INVENTED_" + std::to_string(i), "why");
  EXPECT_EQ(ExposedValue(known), before + 300);
  EXPECT_EQ(ExposedValue(other), 300);
}

TEST(PoolMetrics, SayWhatRunsWaitsAndIsRefused) {
  ComputePool pool({1, 1}, "of the test", errors::v1::STUDIES_FULL);
  const auto value = [](const std::string& what) {
    return ExposedValue("sixpoint_pool_" + what + "{pool=\"of the test\"}");
  };
  EXPECT_EQ(value("slots"), 1);
  const auto soon = [] { return std::chrono::steady_clock::now() + std::chrono::seconds(30); };
  {
    const auto slot = pool.Enter(soon(), nullptr);
    ASSERT_TRUE(slot.ok());
    EXPECT_EQ(value("running"), 1);
    std::atomic<bool> goes_on{true};
    std::thread waits([&] { EXPECT_FALSE(pool.Enter(soon(), [&] { return goes_on.load(); }).ok()); });
    while (pool.use().waiting == 0) std::this_thread::yield();
    EXPECT_FALSE(pool.Enter(soon(), nullptr).ok());
    EXPECT_EQ(value("refused_total"), 1);
    goes_on = false;
    waits.join();
  }
  EXPECT_EQ(value("running"), 0);
  EXPECT_EQ(value("waiting"), 0);
  EXPECT_EQ(value("wait_seconds_count"), 2);
}

}  // namespace
}  // namespace sixpoint::runtime
