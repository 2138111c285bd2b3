// Errors of files, in words that a user can act on.
#pragma once
#include <stdexcept>
#include <string>

namespace cairn {

// The message names the path, the problem and the remedy.
struct FileError : std::runtime_error {
  FileError(std::string path, std::string problem, std::string remedy = "", int number = 0);
  std::string path, problem, remedy;
  int number; // errno, if the system told one
};

// Message for an errno met at a path.
FileError system_error(const std::string& path, int number);

} // namespace cairn
