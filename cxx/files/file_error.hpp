// What can go wrong with a file, said so that a user can act on it.
#pragma once
#include <stdexcept>
#include <string>

namespace cairn {

// The message names the path, what was wrong and what to do.
struct FileError : std::runtime_error {
  FileError(std::string path, std::string problem, std::string remedy = "", int number = 0);
  std::string path, problem, remedy;
  int number; // errno, if the system told one
};

// What errno, met at a path, means in words.
FileError system_error(const std::string& path, int number);

} // namespace cairn
