// What the facts mean, in plain words. Pure: nothing here asks, waits or changes.
#pragma once

#include <string>
#include <vector>

#include "cli/doctor/facts.h"

namespace sixpoint::cli::doctor {

// kUnknown: it could not be looked at, and the words say why. That is no failure by itself: what kept us from it is another line.
enum class Grade { kOk, kWarning, kWrong, kUnknown };
std::string GradeText(Grade grade);

struct Finding {
  std::string check;
  Grade grade = Grade::kOk;
  std::string words;
  std::string next;  // what to do; empty where nothing is
};
using Findings = std::vector<Finding>;

// Of two computers' clocks: beyond the one a warning, beyond the other wrong.
inline constexpr double kClockApart_s = 2, kClockFarApart_s = 30;

// All of them, one line a check, in the order in which a person would look.
Findings Judge(const Facts& facts);

void JudgeHost(const Facts& facts, Findings* findings);
void JudgeProcesses(const Facts& facts, Findings* findings);
void JudgeServices(const Facts& facts, Findings* findings);
void JudgeVersions(const Facts& facts, Findings* findings);
void JudgeCertificates(const Facts& facts, Findings* findings);
void JudgeDatabase(const Facts& facts, Findings* findings);
void JudgeRecord(const Facts& facts, Findings* findings);

// "1.2 GB".
std::string BytesText(double bytes);

}  // namespace sixpoint::cli::doctor
