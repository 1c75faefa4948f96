#!/usr/bin/env bash
# Manual pages and completions say what help says, of every command.
# usage: manual_test.sh VCP WORK
set -euo pipefail
vcp=$1 work=$2
rm -rf "$work"
mkdir -p "$work/pages" "$work/files/folder.d"
touch "$work/files/a file.ply" "$work/files/b.vcp"
cd "$work"

fail() {
    echo "$*"
    exit 1
}

# helpOf PATH: what help says of "vcp meso build".
helpOf() {
    local -a words
    read -ra words <<<"$1"
    "$vcp" help "${words[@]:1}"
}

# optionsOf PATH: the names of its options, those that few need too, as they stand at the beginnings of help's lines.
optionsOf() {
    local -a words
    read -ra words <<<"$1"
    "$vcp" "${words[@]:1}" --help-all | sed -n 's/^  \(-[^ ]*\).*/\1/p' | sed 's/{[^}]*}//g; s/\[=[^]]*\]//g' | tr ',' '\n' | sort -u
}

# commandsOf PATH: it, and the commands that its help lists, and theirs.
commandsOf() {
    echo "$1"
    local name
    for name in $(helpOf "$1" | sed -n '/ommands:$/,/^$/s/^  \([a-z-]*\) .*/\1/p'); do
        [ "$name" = help ] && continue
        commandsOf "$1 $name"
    done
}

mapfile -t paths < <(commandsOf vcp)
[ "${#paths[@]}" -ge 15 ] || fail "only ${#paths[@]} commands: ${paths[*]}"

# Each command has a page, which names each option and each command below.
"$vcp" man --all pages
declare -A options
for path in "${paths[@]}"; do
    options[$path]=$(optionsOf "$path")
    page=pages/${path// /-}.1
    [ -s "$page" ] || fail "there is no $page"
    # Names begin a line or follow a comma.
    named=$(sed 's/\\fB\|\\fI\|\\fR//g; s/\\-/-/g; s/, /\n/g' "$page" | sed 's/[[, ].*//' | sort -u)
    missing=$(comm -23 <(echo "${options[$path]}") <(echo "$named"))
    [ -z "$missing" ] || fail "$page does not name $missing"
done
read -ra words <<<"${paths[1]}"
cmp <("$vcp" man "${words[@]:1}") "pages/${paths[1]// /-}.1" || fail "vcp man prints another page"
if "$vcp" man nonsense 2>said; then fail "vcp man nonsense"; fi
grep 'there is no command "vcp nonsense"' said >/dev/null || fail "$(cat said)"

# bash: what is offered after some words.
"$vcp" completions bash >vcp.bash
# shellcheck disable=SC1091
source ./vcp.bash
offered() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _vcp
    printf '%s\n' "${COMPREPLY[@]}" | sort
}
# offers EXPECTED WORD...: one a line, in order.
offers() {
    local expected=$1 got
    shift
    got=$(offered "$@")
    [ "$got" = "$expected" ] || fail "after \"$*\" bash offers \"$got\", not \"$expected\""
}
offers $'build\nbuild-plan\nbuild-step' vcp bui
offers $'certified\npaper' vcp build --method ''
offers paper vcp build x.ply --method p
offers paper vcp build --method = p
offers $'computed\nmesh' vcp build --vertex-normals ''
offers --method vcp build --meth
cd files
offers $'a file.ply\nb.vcp\nfolder.d' vcp build ''
offers b.vcp vcp render b
offers folder.d vcp build --temp ''
offers '' vcp build --cell ''
cd ..
[ "$(offered vcp bench '')" = "$(for path in "${paths[@]}"; do sed -n 's/^vcp bench \([a-z]*\)$/\1/p' <<<"$path"; done | sort)" ] || fail "bash does not offer the benchmarks"
grep -x render <<<"$(offered vcp help '')" >/dev/null || fail "bash does not offer commands to help"
for path in "${paths[@]}"; do
    read -ra words <<<"$path"
    missing=$(comm -23 <(echo "${options[$path]}") <(offered "${words[@]}" -))
    [ -z "$missing" ] || fail "bash does not offer $missing to $path"
done

# zsh and fish read their scripts, where they are installed.
"$vcp" completions zsh >_vcp
"$vcp" completions fish >vcp.fish
grep -x '#compdef vcp' _vcp >/dev/null
if command -v zsh >/dev/null; then
    zsh -n _vcp
    zsh -fc 'fpath=($PWD $fpath); autoload -Uz compinit && compinit -D -u && [[ $_comps[vcp] == _vcp ]]' || fail "zsh does not take the script"
fi
if command -v fish >/dev/null; then
    fishOffers() { HOME=$work fish --no-config -c "source $work/vcp.fish; complete -C '$2'" | cut -f 1 | grep -x -- "$1" >/dev/null || fail "after \"$2\" fish does not offer $1"; }
    fishOffers build 'vcp bui'
    fishOffers --method 'vcp build --meth'
    fishOffers paper 'vcp build --method '
    fishOffers rays 'vcp bench r'
    (cd files && fishOffers b.vcp 'vcp render b')
fi
"$vcp" --help | grep -E '^  (man|completions) ' && fail "help lists hidden commands"
echo "${#paths[@]} commands"
