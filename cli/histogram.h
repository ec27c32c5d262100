#pragma once

#include <string>
#include <vector>

/// Histograms as SVG.
namespace its::cli {

struct Column {
    std::string name;
    std::vector<double> values;
};

/// One picture of some histograms beside each other, on logarithmic axes where values allow that.
std::string histogram(const std::vector<Column>& columns);

}  // namespace its::cli
