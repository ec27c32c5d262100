#pragma once

#include <string>

#include "common.h"
#include "its/weld.h"
#include "report.h"

/// The option --weld LENGTH of commands that read a mesh.
namespace its::cli {

class WeldOption {
public:
    void declare(CLI::App& app);
    bool given() const { return value_ > 0; }
    /// In mesh units; percentages are of the longest side of this mesh.
    double length(const Mesh& mesh) const;

private:
    double value_ = 0;
    bool percent_ = false;
};

Json weld_json(const WeldReport& report);
/// "12 corners nearer than 0.1 became 5; …"
std::string weld_text(const WeldReport& report);

}  // namespace its::cli
