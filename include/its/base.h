#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "its/export.h"

/// Points, boxes, errors and progress: what every header needs. In all of them M is the surface of a mesh.
namespace ITS_API its {

/// A point or vector; in mesh units unless said otherwise. Axes are 0 x, 1 y, 2 z.
struct Vec3 {
    double x = 0, y = 0, z = 0;

    double& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
    double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    friend bool operator==(const Vec3&, const Vec3&) = default;
};

/// A closed axis-aligned box; min ≤ max on every axis unless it is empty.
struct Box {
    Vec3 min, max;
};

/// Base of every exception this library throws. what() is one line that says what is wrong,
/// where, and what to do.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A mesh or file whose content cannot be used.
class InputError : public Error {
public:
    using Error::Error;
};

/// An option outside its range, or options that contradict each other.
class OptionError : public Error {
public:
    using Error::Error;
};

/// A file that cannot be opened, read or written.
class FileError : public Error {
public:
    using Error::Error;
};

/// The job needs more memory than it may take; thrown before the memory is taken.
class MemoryError : public Error {
public:
    using Error::Error;
};

/// The progress callback asked to stop.
class Cancelled : public Error {
public:
    using Error::Error;
};

/// Called with the name of the stage that is under way and the fraction of the whole call that is done: from 0
/// to 1, and never less than before. Never called by two threads at once; at each hundredth of a stage, and
/// some twenty times a second of a long one. Return false to stop: the running call then throws Cancelled and
/// leaves nothing behind. An empty function reports nothing.
using Progress = std::function<bool(std::string_view stage, double fraction)>;

/// How a call runs, which its result does not depend on: the same bytes for any number of threads. Every
/// function that may use more than one thread takes one.
struct Run {
    /// The most that the call has at work, the calling one among them; 0: as many as the machine has. A call
    /// from within an arena of oneTBB has at most as many as that.
    /// \throws OptionError, from every function that takes it, if negative
    int threads = 0;
    Progress progress = {};
};

}  // namespace its
