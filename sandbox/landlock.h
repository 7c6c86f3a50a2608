// Landlock: the kernel's rules by which a process gives up files, whatever its user may do.
#pragma once

#include <filesystem>
#include <vector>

namespace sixpoint::sandbox {

// The version of the kernel's interface; 0 where it has none, or has it switched off.
int LandlockVersion();
// What a service logs, once, where it is 0.
inline constexpr char kWithoutLandlock[] =
    "this kernel has no Landlock: workers are held by their filter of system calls alone";

// For ever, for this thread and those that it starts: no file is opened, made, listed or removed; from version 4 on no TCP
// port is bound or connected to; from version 6 on no process outside is signalled and no abstract socket reached.
// What is open stays open. Needs no_new_privs. True where the kernel has no Landlock, too; false (errno): it refused.
bool GiveUpFiles();
// For ever, for this process and those that it starts: nothing in the hidden folders is opened, nothing outside of the writable ones is
// made, changed or removed, and no process outside is looked into, though their user might. All that is there now and not hidden is
// read. Absolute paths; hidden ones that are missing stay hidden when they come, writable ones must be there. Needs and sets no_new_privs. True
// where the kernel has no Landlock, too; false (errno): it refused.
bool GiveUpFolders(const std::vector<std::filesystem::path>& hidden,
                   const std::vector<std::filesystem::path>& writable);

}  // namespace sixpoint::sandbox
