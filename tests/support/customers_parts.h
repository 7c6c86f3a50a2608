// Parts that have a customer, each with a blade and one of everything that is recorded of it.
#pragma once

#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::testing {

// Names of what is recorded of one part; `word` is in all that a person chose.
struct CustomersPart {
  std::string word, part, blade, scan, registration, correction, inspection, deviation, sections, reconstruction,
      machining_pass, repair, study, deletion;
  std::string machining_model;  // by PutMachiningModel alone
  std::string drawing;          // by PutDrawing alone
  std::string assessment;       // by PutAssessment alone
  std::string measurement;      // by PutMeasurement alone

  std::vector<std::string> names() const {
    std::vector<std::string> all = {part,       blade,     scan,     registration,   correction,
                                    inspection, deviation, sections, reconstruction, machining_pass,
                                    repair,     study,     deletion};
    if (!machining_model.empty()) all.push_back(machining_model);
    if (!drawing.empty()) all.push_back(drawing);
    if (!assessment.empty()) all.push_back(assessment);
    if (!measurement.empty()) all.push_back(measurement);
    return all;
  }
};

// Machine m1 with a calibration of its sensor and one of its axes, which rest on nothing.
struct MachinesCalibrations {
  std::string sensor, rotation;  // calibrations/{uuid}
};
MachinesCalibrations PutCalibratedMachine(storage::Database* database);

// WORD-part of the customer WORD (empty: everybody's), with WORD-sn and so on; all of it on machine m1. Ends the program where it cannot.
CustomersPart PutCustomersPart(storage::Database* database, const std::string& word, bool has_customer,
                               const MachinesCalibrations& calibrations);
// WORD-edm of that part.
void PutMachiningModel(storage::Database* database, CustomersPart* part);
// WORD-drawing of that part, as PutDrawingOf makes it.
void PutDrawing(storage::Database* database, CustomersPart* part);
// A drawing of the part's first revision: something of everything that one consists of. Gives its name.
std::string PutDrawingOf(storage::Transaction& transaction, const std::string& part_id, const std::string& drawing_id);
// What another instrument measured of that part's blade, by its drawing, which has to be there.
void PutMeasurement(storage::Database* database, CustomersPart* part);
// Of such a drawing's only characteristic. Gives the measurement's name.
std::string PutMeasurementOf(storage::Transaction& transaction, const std::string& part_id,
                             const std::string& blade_serial, const std::string& drawing);
// A deviation map of a blade: of one patch, which was seen and is within its profile tolerance, CHARACTERISTIC. Gives its name.
std::string PutDeviation(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                         const std::string& registration, const std::string& characteristic,
                         const MachinesCalibrations& calibrations);
// A section of a blade: one parameter measured and one not. Gives the measurement's name.
std::string PutSections(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                        const std::string& registration, const std::string& section,
                        const MachinesCalibrations& calibrations);
// A reconstruction of a blade, of one region, that found a shape. Gives its name.
std::string PutReconstruction(storage::Transaction& transaction, const std::string& part_id,
                              const std::string& blade_serial, const std::string& registration,
                              const std::string& region, const MachinesCalibrations& calibrations);
// How it is repaired, of one section and one lap. Gives its name.
std::string PutRepair(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                      const std::string& registration, const MachinesCalibrations& calibrations);
// What a pass over it left, of one region; the reconstruction stands for what was cut. Gives its name.
std::string PutMachiningPass(storage::Transaction& transaction, const std::string& part_id,
                             const std::string& blade_serial, const std::string& registration,
                             const std::string& reconstruction, const MachinesCalibrations& calibrations);
// Of its blade by the first revision of its drawing, which must be there; a blank whose profile no motion cures.
void PutAssessment(storage::Database* database, CustomersPart* part);
// The same of any; one finding of each of everything that it consists of. Gives its name.
std::string PutAssessmentOf(storage::Transaction& transaction, const std::string& part_id,
                            const std::string& blade_serial, const std::string& drawing, const std::string& deviation,
                            const std::string& word);
// So many more registrations of its blade.
void PutRegistrations(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                      const MachinesCalibrations& calibrations, int count);

// That somebody is cleared from now on, or no more.
void Clear(storage::Database* database, const std::string& holder, const std::string& scope);
void Unclear(storage::Database* database, const std::string& holder, const std::string& scope);

}  // namespace sixpoint::testing
