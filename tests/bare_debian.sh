#!/usr/bin/env bash
# The Dockerfile's steps in a bare Debian, without Docker: bash tests/bare_debian.sh FOLDER (root, debootstrap, network).
# Debian's own Python 3.11 stands in for the base image's. At the end the kit packs and draws in it.
set -euo pipefail
root=${1:?name a folder for the system, which must not exist yet}
kit=$(git -C "$(dirname "$0")" rev-parse --show-toplevel)
sources=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources 2>/dev/null || true)
mirror=$(sed -nE '/^(URIs:|deb) +http/{s/^(URIs:|deb) +(http[^ ]+).*/\2/;p;q}' <<< "$sources")

debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates bookworm "$root" "${mirror:-http://deb.debian.org/debian}"
trap 'umount "$root/proc" 2>/dev/null || true' EXIT
mount -t proc proc "$root/proc" 2>/dev/null || true
# how this machine reaches the network: packages, names, certificates
cp -r --dereference --remove-destination /etc/resolv.conf /etc/apt "$root/etc/"
cp -L --remove-destination /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
[ ! -e /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/"

workdir=$(awk '$1 == "WORKDIR" {print $2}' "$kit/Dockerfile")
mkdir -p "$root$workdir"
inside() { chroot "$root" /usr/bin/env HOME=/root DEBIAN_FRONTEND=noninteractive bash -euxc "cd $workdir; $1"; }
# one step a line, in the order of the file
sed -e ':a' -e '/\\$/{N;s/\\\n//;ba' -e '}' "$kit/Dockerfile" | while read -r step words; do
    case $step in
        COPY) case $words in
            ". .") git -C "$kit" archive HEAD | tar -x -C "$root$workdir" ;;
            *) cp "$kit/${words%% *}" "$root$workdir/" ;;
        esac ;;
        RUN) inside "$words" < /dev/null ;;
    esac
done
inside ".venv/bin/rasp figures 00_quickstart" < /dev/null
inside ".venv/bin/jupyter lab --version" < /dev/null
