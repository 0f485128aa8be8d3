// Evaluates the published fits with the code of the collection that transcribed them: see README.md.
//
//   published DIRECTIONS < FITS > VALUES
//
// DIRECTIONS: float64, six a pair (in, out); FITS: a line each, the model's name and its numbers, diffuse first;
// VALUES: float64, f of three channels for each fit and pair.
#include <fstream>
#include <iostream>
#include <sstream>
#include <vector>
#include "bbm/bbm_core.h"
#include "bbm/bsdfmodel.h"
#include "bsdfmodel/he.h"
#include "bsdfmodel/ngan.h"
#include "bsdfmodel/low.h"
#include "bsdfmodel/lowsmooth.h"
#include "bsdfmodel/lowmicrofacet.h"
#include "bsdfmodel/bagher.h"

using namespace bbm;
BBM_IMPORT_CONFIG(doubleRGB);

// Ngan's He with all 64 terms of the series: its own stops when the smallest channel does
using NganHe = scaledmodel<ndf_sampler<he_base<Config, fresnel::cook<Config>, he_eq25::Errata, he_eq78::Westin, 4, 64,
                                               false, 18>, 90, 1, "NganHe64">, bsdf_attr::SpecularScale>;

std::vector<double> pairs, numbers;
size_t at;
double n() { return numbers[at++]; }
Spectrum c() { double r = n(), g = n(), b = n(); return Spectrum{r, g, b}; }

template<class Model> void run(const Model& model, const Spectrum& diffuse) {
  for (size_t i = 0; i < pairs.size(); i += 6) {
    Vec3d in{pairs[i], pairs[i + 1], pairs[i + 2]}, out{pairs[i + 3], pairs[i + 4], pairs[i + 5]};
    Spectrum value = model.eval(in, out) + diffuse * Constants::InvPi();
    double row[3] = {value[0], value[1], value[2]};
    std::cout.write(reinterpret_cast<char*>(row), sizeof row);
  }
}

int main(int, char** argv) {
  std::ifstream file(argv[1], std::ios::binary);
  for (double x; file.read(reinterpret_cast<char*>(&x), sizeof x);) pairs.push_back(x);
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    numbers.clear(), at = 0;
    for (double x; words >> x;) numbers.push_back(x);
    Spectrum d = c();
    if (name == "NganWard") { nganward<Config> m; m.albedo = c(); m.roughness = n(); run(m, d); }
    else if (name == "NganWardDuer") { nganwardduer<Config> m; m.albedo = c(); m.roughness = n(); run(m, d); }
    else if (name == "NganBlinnPhong") { nganblinnphong<Config> m; m.albedo = c(); m.sharpness = n(); run(m, d); }
    else if (name == "NganLafortune") {
      nganlafortune<Config> m; m.albedo = c(); m.Cxy = n(); m.Cz = n(); m.sharpness = n(); run(m, d);
    } else if (name == "NganCookTorrance") {
      ngancooktorrance<Config> m; m.albedo = c(); m.eta = n(); m.ndf.roughness = n(); run(m, d);
    } else if (name == "NganAshikhminShirley") {
      nganashikhminshirley<Config> m; m.albedo = c(); m.fresnelReflectance = n(); m.sharpness = n(); run(m, d);
    } else if (name == "NganHe") {
      NganHe m; m.albedo = c(); m.autocorrelation = n(); m.roughness = n(); m.eta = n(); run(m, d);
    } else if (name == "LowAshikhminShirley") {
      lowashikhminshirley<Config> m; m.albedo = c(); m.sharpness = n(); m.fresnelReflectance = n(); run(m, d);
    } else if (name == "LowCookTorrance") {
      lowcooktorrance<Config> m; m.albedo = c(); m.ndf.roughness = n(); m.eta = n(); run(m, d);
    } else if (name == "LowMicrofacetFit") {
      lowmicrofacetfit<Config> m; m.A = c(); m.ndf.B = n(); m.ndf.C = n(); m.eta = n(); run(m, d);
    } else if (name == "LowSmooth") { lowsmooth<Config> m; m.A = c(); m.B = n(); m.C = n(); m.eta = n(); run(m, d); }
    else if (name == "Bagher") {
      bagher<Config> m; m.albedo = c(); m.ndf.alpha = c(); m.ndf.p = c();
      Spectrum f0 = c(), f1 = c(); m.eta = vec2d<Spectrum>(f0, f1);
      m.ndf.K = c(); m.ndf.Lambda = c(); m.ndf.c = c(); m.ndf.k = c(); m.ndf.theta0 = c(); run(m, d);
    } else { std::cerr << "unknown model " << name << "\n"; return 1; }
  }
}
