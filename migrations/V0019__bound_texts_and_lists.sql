-- The limits of services/runtime/limits.h, checked here too: what one service lets pass, no other can store longer.

ALTER TABLE record_entries
  ADD CONSTRAINT record_entries_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE retention_policies
  ADD CONSTRAINT retention_policies_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE scan_deletions
  ADD CONSTRAINT scan_deletions_requested_by_length CHECK (octet_length(requested_by) <= 200),
  ADD CONSTRAINT scan_deletions_reason_length CHECK (octet_length(reason) <= 1000);
ALTER TABLE calibrations
  ADD CONSTRAINT calibrations_requested_by_length CHECK (octet_length(requested_by) <= 200),
  ADD CONSTRAINT calibrations_environment_note_length CHECK (octet_length(environment_note) <= 1000);
ALTER TABLE calibration_events
  ADD CONSTRAINT calibration_events_requested_by_length CHECK (octet_length(requested_by) <= 200),
  ADD CONSTRAINT calibration_events_reason_length CHECK (octet_length(reason) <= 1000);
ALTER TABLE studies
  ADD CONSTRAINT studies_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE registrations
  ADD CONSTRAINT registrations_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE registration_scans
  ADD CONSTRAINT registration_scans_at_most_64 CHECK (position_index < 64);
ALTER TABLE corrections
  ADD CONSTRAINT corrections_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE inspections
  ADD CONSTRAINT inspections_requested_by_length CHECK (octet_length(requested_by) <= 200);
ALTER TABLE inspection_scans
  ADD CONSTRAINT inspection_scans_at_most_64 CHECK (position_index < 64);
