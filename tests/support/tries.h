#pragma once

namespace its::test {

/// Of n random tries those that this build makes: an eighth under sanitizers, which look for other faults than
/// a wrong answer, and under an emulator; both are 5 to 20 times slower.
constexpr int tries(int n) {
#if defined(ITS_SANITIZED) || defined(ITS_EMULATED)
    return (n + 7) / 8;
#else
    return n;
#endif
}

}  // namespace its::test
