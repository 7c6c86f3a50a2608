#include "services/runtime/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "identity/credentials.h"
#include "services/runtime/server.h"
#include "services/runtime/tls_socket.h"

namespace sixpoint::runtime {
namespace {

std::vector<Reading> One(std::optional<double> value) {
  if (!value) return {};
  return {{{}, *value}};
}

// A field of /proc/self/stat by proc(5)'s numbers, of those after the name, which may hold anything.
std::optional<double> StatField(int number) {
  std::ifstream file("/proc/self/stat");
  std::string text;
  if (!std::getline(file, text) || text.rfind(')') == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string field;
  for (int i = 3; i <= number; ++i)
    if (!(fields >> field)) return std::nullopt;
  return std::stod(field);
}

std::optional<double> ResidentBytes() {
  const auto pages = StatField(24);
  return pages ? std::optional(*pages * static_cast<double>(sysconf(_SC_PAGESIZE))) : std::nullopt;
}

std::optional<double> OpenDescriptors() {
  std::error_code error;
  double count = 0;
  for (std::filesystem::directory_iterator each("/proc/self/fd", error), end; !error && each != end;
       each.increment(error))
    ++count;
  return error ? std::nullopt : std::optional(count - 1);  // less the one that this looked with
}

std::optional<double> MostDescriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return std::nullopt;
  return static_cast<double>(limit.rlim_cur);
}

std::optional<double> CpuSeconds() {
  rusage use{};
  if (getrusage(RUSAGE_SELF, &use) != 0) return std::nullopt;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

std::vector<Reading> SecondsLeft(const std::vector<std::pair<std::string, std::filesystem::path>>& files) {
  std::vector<Reading> readings;
  for (const auto& [whose, file] : files)
    if (const auto end = CertificateEnd(file))
      readings.push_back({{whose}, std::chrono::duration<double>(*end - std::chrono::system_clock::now()).count()});
  return readings;
}

}  // namespace

ProcessMetrics::ProcessMetrics(const std::string& area, const std::filesystem::path& certificates) {
  const auto add = [this](const char* name, const char* help, std::optional<double> (*ask)(),
                          Computed::Type type = Computed::Type::kGauge) {
    all_.push_back(std::make_unique<Computed>(
        name, help, std::vector<std::string>{}, [ask] { return One(ask()); }, type));
  };
  add("process_resident_memory_bytes", "Resident memory.", ResidentBytes);
  add("process_virtual_memory_bytes", "Virtual memory.", [] { return StatField(23); });
  add("process_threads", "Threads.", [] { return StatField(20); });
  add("process_open_fds", "Open file descriptors.", OpenDescriptors);
  add("process_max_fds", "Most file descriptors that may be open.", MostDescriptors);
  add("process_cpu_seconds_total", "Processor time, of the user's and the system's.", CpuSeconds,
      Computed::Type::kCounter);
  all_.push_back(std::make_unique<Computed>(
      "sixpoint_certificate_expiry_seconds", "Time until a certificate ends; below 0 after it.",
      std::vector<std::string>{"certificate"}, [certificates] {
        return SecondsLeft({{"service", certificates / identity::kIdentityFile},
                            {"authority", certificates / identity::kAuthorityFile}});
      }));
  const auto started = std::chrono::system_clock::now();
  all_.push_back(std::make_unique<Computed>(
      "process_start_time_seconds", "When it started, since 1970.", std::vector<std::string>{},
      [started] { return One(std::chrono::duration<double>(started.time_since_epoch()).count()); }));
  all_.push_back(std::make_unique<Computed>("sixpoint_build_info", "1, with what runs here as labels.",
                                            std::vector<std::string>{"area", "version"}, [area] {
                                              return std::vector<Reading>{{{area, SoftwareVersion()}, 1}};
                                            }));
}

}  // namespace sixpoint::runtime
