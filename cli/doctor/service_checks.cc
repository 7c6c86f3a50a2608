#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "cli/doctor/checks.h"
#include "refusal/message_text.h"

namespace sixpoint::cli::doctor {
namespace {

constexpr double kManyDescriptors = 0.8;
constexpr std::int64_t kFewDescriptors = 1024;
constexpr int kOftenADay = 5;
constexpr double kSlowAnswer_s = 2;

std::string LogsOf(const std::string& area) { return "sixpoint logs " + area + " --since 10m"; }

// One word of what is wrong with a service, from its own sentence or from what its port does.
Finding FindingOf(const Facts& facts, const Service& service) {
  const std::string name = "service: " + service.area;
  if (service.health == "SERVING") {
    if (!service.refused.empty())
      return {name, Grade::kWarning, "serves, and refuses us: " + service.refused, "sixpoint certs show"};
    const bool slow = service.answer_s.value_or(0) > kSlowAnswer_s;
    char answer[60];
    std::snprintf(answer, sizeof answer, ", answers within %.0f ms", 1e3 * service.answer_s.value_or(0));
    return {name, slow ? Grade::kWarning : Grade::kOk, "serves" + (service.answer_s ? std::string(answer) : ""),
            slow ? LogsOf(service.area) : ""};
  }
  const std::string why = service.why.empty() ? "" : ": " + service.why;
  if (service.health == "NOT_SERVING")
    return {name, Grade::kWrong, "runs and does not serve" + why,
            "cure what it says; it serves by itself then. " + LogsOf(service.area)};
  if (service.health == "NOT_TRUSTED")
    return {name, Grade::kWrong,
            "what answers at " + service.address + " does not show a certificate of this plant's authority that counts",
            "sixpoint certs renew; and see which program holds the port: ss -ltnp"};
  if (service.health == "SILENT")
    return {name, Grade::kWrong, "accepts connections at " + service.address + " and answers nothing: it is stuck",
            facts.is_local ? "the watchdog ends it within a minute; by hand: supervisorctl -c " + facts.data +
                                 "/supervisord.conf signal KILL " + service.area
                           : "on its computer: sixpoint doctor"};
  return {name, facts.is_local && !facts.supervised ? Grade::kUnknown : Grade::kWrong,
          "nothing answers at " + service.address + why,
          facts.is_local && !facts.supervised ? ""
          : facts.is_local                    ? LogsOf(service.area)
                                              : "on its computer: sixpoint doctor"};
}

void JudgePorts(const Facts& facts, Findings* findings) {
  std::string wrong, unknown;
  for (const Service& service : facts.services) {
    if (!service.listeners_known) return;
    const std::string at = std::to_string(service.port);
    if (!service.listener) continue;  // nobody: the service's own line says so
    if (!service.listener->pid) {
      unknown += (unknown.empty() ? "" : ", ") + at;
    } else if (!service.pid || *service.listener->pid != *service.pid) {
      wrong += (wrong.empty() ? "" : ", ") + at + " by " + Tame(service.listener->program, 60) + " (pid " +
               std::to_string(*service.listener->pid) + ")";
    }
  }
  if (!wrong.empty()) {
    findings->push_back({"ports", Grade::kWrong, "held by others than the plant's services: " + wrong,
                         "end that program, or give the plant other ports: sixpoint up --base-port N"});
  } else if (!unknown.empty()) {
    findings->push_back({"ports", Grade::kUnknown, "who listens at " + unknown + " is not this user's to see", ""});
  } else {
    findings->push_back({"ports", Grade::kOk, "held by nobody but the plant's own services", ""});
  }
}

void JudgeClocks(const Facts& facts, Findings* findings) {
  std::string apart;
  double greatest_s = 0;
  int asked = 0;
  for (const Service& service : facts.services) {
    if (!service.clock_ahead_s) continue;
    ++asked;
    const double apart_s = std::abs(*service.clock_ahead_s) - service.clock_doubt_s.value_or(0);
    if (apart_s <= kClockApart_s) continue;
    greatest_s = std::max(greatest_s, apart_s);
    char text[100];
    std::snprintf(text, sizeof text, "%s%s's by %.3g s", apart.empty() ? "" : ", ", service.area.c_str(),
                  *service.clock_ahead_s);
    apart += text;
  }
  if (asked == 0) return;
  if (apart.empty()) {
    findings->push_back({"clocks of services", Grade::kOk, "agree with ours", ""});
  } else {
    findings->push_back({"clocks of services", greatest_s > kClockFarApart_s ? Grade::kWrong : Grade::kWarning,
                         "differ from ours: " + apart, "have all computers' clocks kept by one time service"});
  }
}

void JudgeDescriptors(const Facts& facts, Findings* findings) {
  std::string full, few;
  int seen = 0;
  for (const Service& service : facts.services) {
    if (!service.descriptor_limit || *service.descriptor_limit <= 0) continue;
    ++seen;
    if (service.descriptor_count &&
        double(*service.descriptor_count) / double(*service.descriptor_limit) > kManyDescriptors)
      full += (full.empty() ? "" : ", ") + service.area + " has " + std::to_string(*service.descriptor_count) + " of " +
              std::to_string(*service.descriptor_limit);
    if (*service.descriptor_limit < kFewDescriptors)
      few += (few.empty() ? "" : ", ") + service.area + " may have " + std::to_string(*service.descriptor_limit);
  }
  if (seen == 0) return;
  const std::string raise = "raise the limit of who starts the plant (ulimit -Hn), then: sixpoint up";
  if (!full.empty()) {
    findings->push_back({"file descriptors", Grade::kWrong, full + ": new connections are refused soon", raise});
  } else if (!few.empty()) {
    findings->push_back({"file descriptors", Grade::kWarning, few + ", want 1024 or more", raise});
  } else {
    findings->push_back({"file descriptors", Grade::kOk, "every service has enough", ""});
  }
}

std::string Listed(const std::map<std::string, int>& counts) {
  std::string text;
  for (const auto& [program, count] : counts)
    text += (text.empty() ? "" : ", ") + program + " " + std::to_string(count) + (count == 1 ? " time" : " times");
  return text;
}

void JudgeRestarts(const Facts& facts, Findings* findings) {
  if (!facts.restarts) return;
  const Restarts& restarts = *facts.restarts;
  if (!restarts.crashes.empty())
    findings->push_back({"crashes", Grade::kWrong, "in a day by a signal: " + Listed(restarts.crashes),
                         "sixpoint logs supervisord --since 1d, and the core dumps (" +
                             facts.host.core_pattern.value_or("/proc/sys/kernel/core_pattern") +
                             "): report them with the release"});
  int most = 0, all = 0;
  for (const auto& [program, count] : restarts.unexpected_ends) {
    most = std::max(most, count);
    all += count;
  }
  if (most >= kOftenADay) {
    findings->push_back({"restarts", Grade::kWarning, "in a day ended unasked: " + Listed(restarts.unexpected_ends),
                         "sixpoint logs --since 1d --level warning"});
  } else {
    findings->push_back({"restarts", Grade::kOk,
                         all == 0 ? "none unasked in a day" : "few in a day: " + Listed(restarts.unexpected_ends), ""});
  }
  if (!restarts.ended_by_watchdog.empty())
    findings->push_back({"stuck services", Grade::kWarning,
                         "ended by the watchdog in a day: " + Listed(restarts.ended_by_watchdog),
                         "sixpoint logs watchdog --since 1d"});
}

}  // namespace

void JudgeProcesses(const Facts& facts, Findings* findings) {
  if (!facts.is_local) return;
  if (!facts.supervised) {
    const bool stuck = !facts.supervisor_why_not.empty();
    findings->push_back({"supervisor", Grade::kWrong, stuck ? facts.supervisor_why_not : "nothing of this plant runs",
                         stuck ? "end it and start the plant anew: sixpoint down; sixpoint up" : "sixpoint up"});
    return;
  }
  findings->push_back({"supervisor", Grade::kOk, "runs", ""});
  const bool watches = facts.watchdog_state == "RUNNING";
  findings->push_back({"watchdog", watches ? Grade::kOk : Grade::kWrong,
                       watches ? "runs"
                               : "does not run (" + (facts.watchdog_state.empty() ? "unknown" : facts.watchdog_state) +
                                     "): a service that is stuck stays so",
                       watches ? "" : "sixpoint logs watchdog supervisord --since 10m; then: sixpoint up"});
  JudgeRestarts(facts, findings);
}

void JudgeServices(const Facts& facts, Findings* findings) {
  if (!facts.services_why_not.empty())
    findings->push_back({"services", Grade::kWrong, facts.services_why_not,
                         "on the plant's computer: sixpoint doctor; here: sixpoint certs show"});
  for (const Service& service : facts.services) findings->push_back(FindingOf(facts, service));
  if (facts.is_local) JudgePorts(facts, findings);
  JudgeClocks(facts, findings);
  JudgeDescriptors(facts, findings);
}

void JudgeVersions(const Facts& facts, Findings* findings) {
  std::set<std::string> running;
  std::string behind;
  for (const Service& service : facts.services) {
    if (service.version) running.insert(*service.version);
    if (service.version && service.program_version && *service.version != *service.program_version)
      behind += (behind.empty() ? "" : ", ") + service.area;
  }
  if (running.empty()) return;
  if (!behind.empty()) {
    findings->push_back({"versions", Grade::kWarning,
                         "still run the program before the one that is installed: " + behind, "sixpoint up"});
  } else if (running.size() > 1) {
    std::string words;
    for (const std::string& version : running) words += (words.empty() ? "" : ", ") + Tame(version, 60);
    findings->push_back({"versions", Grade::kWarning, "services of different releases run: " + words,
                         "sixpoint up of the newest release"});
  } else if (*running.begin() != facts.own_version) {
    findings->push_back({"versions", Grade::kWarning,
                         "the plant runs " + Tame(*running.begin(), 60) + ", this tool is " + facts.own_version,
                         "use the tool of the plant's release"});
  } else {
    findings->push_back({"versions", Grade::kOk, "every program is " + facts.own_version, ""});
  }
}

}  // namespace sixpoint::cli::doctor
