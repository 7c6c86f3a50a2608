// What the supervisor does not see: services that live and answer nobody.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Way {
  const char* command;  // what is done to the service
  double patience_s;
};
void PrintTo(const Way& way, std::ostream* out) { *out << way.command; }

class StuckServiceTest : public PlantOnThisMachine, public ::testing::WithParamInterface<Way> {};

TEST_P(StuckServiceTest, IsStartedAnew) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string stuck = Pid("ingest"), other = Pid("plant");
  ASSERT_EQ(ServiceShellOutput("pid=" + stuck + "; " + GetParam().command), "");
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  while (seconds() < GetParam().patience_s &&
         (Pid("ingest") == stuck || Run({"status", "--data", data()}).exit_code != 0)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (Pid("ingest") == stuck) ServiceShellOutput("pid=" + stuck + "; " + GetParam().command);
  }
  std::printf("%s: serves again after %.1f s\n", GetParam().command, seconds());
  EXPECT_LT(seconds(), GetParam().patience_s);
  EXPECT_EQ(Pid("plant"), other);
  EXPECT_EQ(Run({"scan", "list", "--json", "--server", At("127.0.0.1")}).text, "[]\n");
}

INSTANTIATE_TEST_SUITE_P(
    Ways, StuckServiceTest,
    ::testing::Values(
        // 12 s of silence, the supervisor's second, the start; the rest is for a busy machine.
        Way{"kill -STOP $pid", 40},
        // No descriptor is left for another connection: it refuses each, for a minute, and then it will not recover by itself. 20 looks, 3 s
        // apart and of up to 5 s each where the machine is busy. What it closes meanwhile is taken from it too: with one place free it
        // would answer, and rightly be let live.
        Way{"n=0; while [ -e /proc/$pid/fd/$n ]; do n=$((n + 1)); done; prlimit --pid $pid --nofile=$n:", 180}));

using StuckPlantTest = PlantOnThisMachine;

TEST_F(StuckPlantTest, TheGatewayIsStartedAnewToo) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string stuck = Pid("gateway");
  ASSERT_EQ(ServiceShellOutput("kill -STOP " + stuck), "");
  EXPECT_THAT(Run({"status", "--data", data()}).text, HasSubstr("SILENT"));
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(40);
  while (std::chrono::steady_clock::now() < end &&
         (Pid("gateway") == stuck || Run({"status", "--data", data()}).exit_code != 0))
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_NE(Pid("gateway"), stuck);
  EXPECT_EQ(Run({"status", "--data", data()}).exit_code, 0);
}

// No restart brings the database back.
TEST_F(StuckPlantTest, NotServingIsAnAnswer) {
  ASSERT_EQ(Up().exit_code, 0);
  std::string before;
  for (const std::string& area : PlantProcesses::Areas()) before += Pid(area) + " ";
  Order("stop postgres");
  std::this_thread::sleep_for(std::chrono::seconds(16));  // longer than a silent service is borne
  const Answer status = Run({"status", "--data", data()});
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_THAT(status.text, HasSubstr("NOT_SERVING"));
  std::string after;
  for (const std::string& area : PlantProcesses::Areas()) after += Pid(area) + " ";
  EXPECT_EQ(after, before);
  EXPECT_THAT(ReadFile(data() + "/log/watchdog.log"), Not(HasSubstr("does not answer")));
}

}  // namespace
}  // namespace sixpoint::testing
