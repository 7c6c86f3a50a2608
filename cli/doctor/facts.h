// What `sixpoint doctor` found out about a plant, before it judges any of it. What could not be found out is unset.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "identity/credentials.h"

namespace sixpoint::cli::doctor {

using Time = std::chrono::system_clock::time_point;

struct Disk {
  std::string what;  // "data folder", "PostgreSQL", ...
  std::string path;
  std::string why_not;  // it could not be asked
  double free_bytes = 0, total_bytes = 0;
  std::optional<double> free_inode_part;
  bool read_only = false;
};

// This computer's.
struct Host {
  std::vector<Disk> disks;
  std::optional<double> memory_bytes, available_memory_bytes;
  std::optional<bool> clock_synchronised;  // as the kernel says
  std::optional<double> clock_error_s;     // greatest, as the kernel estimates it
  std::optional<bool> seccomp;             // filters that end a process
  std::optional<int> landlock_version;     // 0: none
  std::optional<std::string> core_pattern;
};

struct Listener {
  std::optional<pid_t> pid;  // where this user may see whose it is
  std::string program;
};

struct Service {
  std::string area, address;
  std::string health;   // cli/service_health.h
  std::string why;      // it does not serve, in its own words
  std::string refused;  // the answer to a call of ours, where that was a refusal
  std::optional<double> answer_s;
  std::optional<std::string> version;
  // Its clock less ours; the answer says no more than this closely.
  std::optional<double> clock_ahead_s, clock_doubt_s;
  std::optional<identity::IssuedCertificate> shown;  // the certificate of its port
  // Of a plant on this computer:
  std::string state;  // supervisord's word; empty: it knows none
  std::optional<pid_t> pid;
  int port = 0;
  std::optional<Listener> listener;  // none: nobody listens at its port
  bool listeners_known = false;
  std::optional<std::int64_t> descriptor_count, descriptor_limit;
  std::optional<std::string> program_version;  // of the file that a restart would run
};

struct CertificateFile {
  bool is_authority = false;  // of which the key alone is looked at; its certificate is in everybody's folder
  bool is_missing = false;    // of the authority: its key is kept elsewhere, or lost
  std::string whose;          // "ingest", "you", "authority"
  std::string path;
  std::optional<identity::IssuedCertificate> certificate;
  std::string why_not;               // it is none, or key, certificate and authority do not belong together
  std::string standing;              // what a service would say of it; empty: it counts
  bool others_read = false;          // the private key
  bool is_other_authoritys = false;  // its authority.pem is not the plant's
};

struct Statement {
  std::string user, query;
  std::int64_t pid = 0, seconds = 0;
};

struct Database {
  std::string why_not;  // it does not answer
  int version_number = 0;
  std::map<std::string, std::string> settings;
  std::optional<double> clock_ahead_s, clock_doubt_s;
  int connection_count = 0, connection_limit = 0;
  std::int64_t checksum_failure_count = 0, oldest_xid_age = 0, size_bytes = 0;
  // What people asked for runs, and nothing of it was done yet where `activity_why_not` says why.
  std::string activity_why_not;
  std::vector<Statement> slow, long_transactions;
  int journal_waiter_count = 0, lock_waiter_count = 0;
  std::optional<Statement> journal_holder;
  std::string record_why_not;
  std::optional<int> schema_version;
  std::optional<int> months_ahead;  // -1: this month is missing
  std::optional<std::int64_t> damage_count, overdue_scan_count;
  std::optional<Time> check_finished_at, check_begun_at;
  std::optional<std::int64_t> blob_count;
  std::string bloated_table;
  double bloated_part = 0;
};

// Of the day before now.
struct Restarts {
  std::map<std::string, int> unexpected_ends;  // by program
  std::map<std::string, int> crashes;          // of these, by a signal that nobody sends
  std::map<std::string, int> ended_by_watchdog;
};

struct Facts {
  bool is_local = false;  // the plant of a folder on this computer; else what a server answers
  std::string data, server;
  std::string settings_why_not;  // plant.json cannot be read
  std::string own_version;
  int newest_migration = 0;
  Time now;
  Host host;
  bool supervised = false;
  std::string supervisor_why_not;
  std::string watchdog_state;
  std::vector<Service> services;
  std::string services_why_not;  // the plant could not be asked where they are
  std::vector<CertificateFile> certificates;
  std::string revocation_why_not;
  bool blobs_in_object_store = false;
  std::optional<Database> database;
  std::optional<Database> store;  // of a plant elsewhere: what its store says, and nothing of the rest
  std::optional<Restarts> restarts;
};

}  // namespace sixpoint::cli::doctor
