#pragma once

#include <chrono>

#include "its/export.h"

namespace ITS_API its {

/// Seconds since construction, on a clock that nobody sets: the one clock of all reports.
class Stopwatch {
public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace its
