// Files that one writer alone has: made under another name, locked for as long as they are written.
//
// The lock is one of open files, on a byte that no file reaches: the system lets go of it when the process ends,
// however it ends, and it hinders nobody who reads. A `.part` that is locked belongs to a run that lives, one that is
// not was left by a run that was killed, and is cleaned.
#pragma once
#include <string>
#include <string_view>
#include <utility>

#include "file_error.hpp"

namespace cairn {

enum class Lock { taken, held_by_another, unknown }; // unknown: the system knows no such locks

Lock lock_for_writing(int descriptor);
bool stands(int descriptor, const std::string& path); // whether the open file is the one at the path, no link
bool exists(const std::string& path);                 // a link that leads nowhere does, too
bool is_folder(const std::string& path);
void refuse_if_written(const std::string& path); // by a writer that lives
FileError being_written(const std::string& path);

// Descriptor of a new file at `part`, which is to become `path`, locked. Throws FileError if another run writes it, if
// it is a link (it is never followed), or if it cannot be made.
int create_part(const std::string& part, const std::string& path);
// The same under a name `.<name>.*.part` beside the path that nobody has; those that killed writers left are removed.
std::pair<int, std::string> create_part_beside(const std::string& path);
// Writes a path that is the old file or the new one at every instant, over a `.part` file with a single writer. beside:
// the `.part` has a unique name, so that several writers may come; else it is `<path>.part`, and a second writer is
// refused.
void write_whole(const std::string& path, std::string_view data, bool beside);
void sync_folder_of(const std::string& path); // brings a new name itself to the disk

} // namespace cairn
