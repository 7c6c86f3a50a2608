// Finds out the facts. Each question ends within seconds, whatever is asked hangs; nothing is changed, and nothing needs to run.
#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/doctor/facts.h"
#include "cli/local_plant.h"
#include "cli/session.h"

namespace sixpoint::cli::doctor {

// Of the plant in a folder of this computer; `plant` none: its settings cannot be read, and only the computer is looked at.
Facts GatherLocal(Session* session, const std::optional<LocalPlant>& plant);
// Of the plant that answers there.
Facts GatherRemote(Session* session);

// One part each.
Host GatherHost(const std::optional<LocalPlant>& plant);
Database GatherDatabase(const LocalPlant& plant);
std::vector<CertificateFile> GatherCertificates(const LocalPlant& plant, std::string* revocation_why_not);
Restarts GatherRestarts(const LocalPlant& plant, Time since);
// `state`, `pid`, listeners and descriptors of processes on this computer.
void GatherProcesses(const LocalPlant& plant, Facts* facts);
// Health, answer, version, clock and certificate, by calls. `own` may be null: then nobody is asked but for his health.
void AskService(const std::shared_ptr<grpc::ChannelCredentials>& nobody,
                const std::shared_ptr<grpc::ChannelCredentials>& own, Service* service);
// By the store's own answers, where there is no database to ask.
Database AskStore(Session* session);

}  // namespace sixpoint::cli::doctor
