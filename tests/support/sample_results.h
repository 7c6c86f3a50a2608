// Results as they are kept, each with one of everything that it consists of. They hold every constraint of the record once they say by
// which id, of which blade, part, registration and calibrations they are, and have the scans that they name.
#pragma once

#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"
#include "storage/machining_passes.h"
#include "storage/measurements.h"
#include "storage/reconstructions.h"
#include "storage/repairs.h"
#include "storage/sections.h"

namespace sixpoint::testing {

// Of the holes G1/H1, which is good, and G1/H2, in which no pin stood.
storage::InspectionRow SampleInspection();
// Of one patch, which was seen and is within its profile tolerance, "17".
storage::DeviationMapRow SampleDeviation();
// The section "50 %": one parameter measured and one not.
storage::SectionMeasurementRow SampleSections();
// Of the region "edge", which found a shape.
storage::ReconstructionRow SampleReconstruction();
// What was left of the region "edge": nothing that is to be done.
storage::MachiningPassRow SampleMachiningPass();
// Of one section and one lap.
storage::RepairRow SampleRepair();
// A blank whose profile, characteristic "1", no motion cures, by the first of its results, which is to be named.
storage::AssessmentRow SampleAssessment();
// Of characteristic "1" alone.
storage::MeasurementRow SampleMeasurement();

}  // namespace sixpoint::testing
