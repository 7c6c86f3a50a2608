// Measured sections as a report draws and lists them.
#pragma once

#include "report/report.h"
#include "sixpoint/inspection/v1/section.pb.h"

namespace sixpoint::inspection {

// outline: of that section; its values are told without a verdict.
report::Section SectionOf(const v1::Section& section, const v1::SectionOutline& outline);

}  // namespace sixpoint::inspection
