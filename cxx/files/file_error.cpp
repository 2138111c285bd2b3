#include "file_error.hpp"

#include <cerrno>
#include <cstring>

namespace cairn {

FileError::FileError(std::string where, std::string what, std::string action, int n)
    : std::runtime_error(where + ": " + what + (action.empty() ? "" : "; " + action)), path(std::move(where)),
      problem(std::move(what)), remedy(std::move(action)), number(n) {}

FileError system_error(const std::string& path, int number) {
  const char* const room = "free some space, or write to another disk";
  const char* const rights = "choose a folder you may write to, or change its permissions";
  switch (number) {
  case ENOSPC: return {path, "the disk is full", room, number};
  case EDQUOT: return {path, "the disk quota is used up", room, number};
  case EFBIG: return {path, "the file may not grow any further", "raise the limit on file sizes (ulimit -f)", number};
  case EACCES:
  case EPERM: return {path, "permission denied", rights, number};
  case EROFS: return {path, "the file system is read-only", "choose another folder", number};
  case ENOENT: return {path, "no such file or folder", "check the path, or make the folder first", number};
  case ENOTDIR: return {path, "a part of the path is not a folder", "check the path", number};
  case EISDIR: return {path, "this is a folder", "give the name of a file", number};
  default: return {path, std::strerror(number), "look at the disk and the path, or write to another disk", number};
  }
}

} // namespace cairn
