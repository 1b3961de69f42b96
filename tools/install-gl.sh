#!/bin/sh
# Drawing without a display needs EGL and Mesa's software driver. Installs them on Debian and Ubuntu, or says how.
set -eu
packages="libegl1 libgl1 libgl1-mesa-dri"
if ldconfig -p 2>/dev/null | grep -q 'libEGL\.so\.1' && ldconfig -p | grep -q 'libGL\.so\.1'; then exit 0; fi
if command -v apt-get >/dev/null 2>&1; then
  if [ "$(id -u)" = 0 ]; then as_root=""; elif sudo -n true 2>/dev/null; then as_root="sudo"; else as_root="no"; fi
  if [ "$as_root" != no ]; then
    $as_root apt-get update -qq && $as_root apt-get install -y -qq --no-install-recommends $packages && exit 0
  fi
fi
echo "Pictures need EGL and Mesa. Install them once with:  sudo apt-get install $packages" >&2
