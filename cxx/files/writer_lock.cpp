#include "writer_lock.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <memory>
#include <tuple>
#include <vector>

namespace cairn {

namespace {

constexpr off_t beyond = off_t(1) << 62; // no file is that long
const char* const another_name = "choose another name";

struct Descriptor { // closed at the end of the block
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

void clean(const std::string& part, const std::string& path) {
  struct stat there {};
  if (::lstat(part.c_str(), &there) != 0) return;
  if (!S_ISREG(there.st_mode))
    throw FileError(path,
                    part + ", in its way, is " + (S_ISLNK(there.st_mode) ? "a link" : "no plain file") +
                        ", and is not followed",
                    "remove " + part + ", or choose another name");
  const Descriptor left{::open(part.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK)};
  if (left.fd < 0) {
    if (errno == ENOENT) return;
    throw system_error(path, errno);
  }
  switch (lock_for_writing(left.fd)) {
  case Lock::held_by_another: throw being_written(path);
  case Lock::unknown:
    throw FileError(path, part + " is there, and whether a run writes it cannot be told",
                    "if none does, remove " + part);
  case Lock::taken:
    if (stands(left.fd, part)) ::unlink(part.c_str());
  }
}

std::pair<std::string, std::string> split(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? std::pair{std::string("."), path}
                                    : std::pair{slash ? path.substr(0, slash) : "/", path.substr(slash + 1)};
}

// Why a file could not be made: of a folder that is there and takes none, as /proc, the system says that there is no
// file.
FileError not_made(const std::string& path, int number) {
  const std::string folder = split(path).first;
  struct stat there;
  if (number == ENOENT && ::stat(folder.c_str(), &there) == 0 && S_ISDIR(there.st_mode))
    return {path, "cannot be written: the folder " + folder + " takes no files", "choose another folder", number};
  return system_error(path, number);
}

void remove_stale(const std::string& folder, const std::string& prefix) {
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(::opendir(folder.c_str()), &::closedir);
  if (!entries) throw system_error(folder, errno);
  std::vector<std::string> left;
  while (const dirent* entry = ::readdir(entries.get())) {
    const std::string name = entry->d_name;
    if (name.starts_with(prefix) && name.ends_with(".part")) (left.emplace_back(folder) += '/') += name;
  }
  for (const std::string& path : left) {
    const Descriptor d{::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK)};
    if (d.fd >= 0 && lock_for_writing(d.fd) == Lock::taken && stands(d.fd, path)) ::unlink(path.c_str());
  }
}

} // namespace

FileError being_written(const std::string& path) {
  return {path, "another run is writing this file", "let it end, or choose another name"};
}

Lock lock_for_writing(int descriptor) {
#ifdef F_OFD_SETLK
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = beyond;
  lock.l_len = 1;
  if (::fcntl(descriptor, F_OFD_SETLK, &lock) == 0) return Lock::taken;
  return errno == EAGAIN || errno == EACCES ? Lock::held_by_another : Lock::unknown;
#else
  return Lock::unknown;
#endif
}

bool stands(int descriptor, const std::string& path) {
  struct stat there {
  }, here{};
  return ::lstat(path.c_str(), &there) == 0 && ::fstat(descriptor, &here) == 0 && here.st_dev == there.st_dev &&
         here.st_ino == there.st_ino;
}

bool exists(const std::string& path) {
  struct stat there {};
  return ::lstat(path.c_str(), &there) == 0;
}

bool is_folder(const std::string& path) {
  struct stat there {};
  return ::stat(path.c_str(), &there) == 0 && S_ISDIR(there.st_mode);
}

void refuse_if_written(const std::string& path) {
  const Descriptor d{::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK)};
  if (d.fd >= 0 && lock_for_writing(d.fd) == Lock::held_by_another) throw being_written(path);
}

int create_part(const std::string& part, const std::string& path) {
  for (;;) {
    const int made = ::open(part.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (made < 0) {
      if (errno != EEXIST) throw not_made(path, errno);
      clean(part, path);
      continue;
    }
    if (lock_for_writing(made) != Lock::held_by_another && stands(made, part)) return made;
    ::close(made); // another has taken it for a stale one before it was locked
    throw being_written(path);
  }
}

std::pair<int, std::string> create_part_beside(const std::string& path) {
  const auto [folder, name] = split(path);
  remove_stale(folder, "." + name + ".");
  for (;;) {
    std::string made = folder;
    made.append("/.").append(name).append(".XXXXXX.part");
    const int fd = ::mkostemps(made.data(), 5, O_CLOEXEC);
    if (fd < 0) throw not_made(path, errno);
    if (lock_for_writing(fd) != Lock::held_by_another && stands(fd, made)) {
      const mode_t mask = ::umask(0);
      ::umask(mask);
      ::fchmod(fd, 0666 & ~mask);
      return {fd, made};
    }
    ::close(fd); // another has cleaned it before it was locked
  }
}

void write_whole(const std::string& path, std::string_view data, bool beside) {
  std::string made = path + ".part";
  Descriptor part{-1};
  if (beside)
    std::tie(part.fd, made) = create_part_beside(path);
  else
    part.fd = create_part(made, path);
  const auto give_up = [&](int error) {
    if (stands(part.fd, made)) ::unlink(made.c_str());
    throw system_error(path, error);
  };
  while (!data.empty()) {
    const ssize_t written = ::write(part.fd, data.data(), data.size());
    if (written < 0 && errno != EINTR) give_up(errno);
    if (written > 0) data.remove_prefix(std::size_t(written));
  }
  if (::rename(made.c_str(), path.c_str()) != 0) give_up(errno);
}

void sync_folder_of(const std::string& path) {
  const Descriptor folder{::open(split(path).first.c_str(), O_RDONLY | O_CLOEXEC)};
  if (folder.fd >= 0) ::fsync(folder.fd);
}

} // namespace cairn
