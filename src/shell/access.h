#pragma once

#include "its/shell.h"
#include "shell/shell_data.h"

namespace its::shell {

/// The library's own way to what is behind a ThinShell.
struct Access {
    static ThinShell make(ShellData data, const BuildSeconds& seconds = {});
    static const ShellData& data(const ThinShell& shell);
};

}  // namespace its::shell
